"""Consumers of a node: SYNC, node guarding, TIME and EMCY.

All are off by default; then they cost no time in the cycle.
"""

from collections.abc import Callable, Iterator
from functools import partial

from hil_sim.node import emcy
from hil_sim.node.dictionary import Dictionary
from hil_sim.node.emergency_consumer import CONSUMED, EmergencyConsumer
from hil_sim.node.nmt import NEVER_US, Clock
from hil_sim.node.node_guarding import GUARD_TIME, LIFE_TIME_FACTOR, NodeGuarding
from hil_sim.node.sync_consumer import OVERFLOW, WINDOW, SyncConsumer
from hil_sim.node.time_consumer import TIME, TimeConsumer

SYNC_OBJECTS = (WINDOW, OVERFLOW)
GUARDING_OBJECTS = (GUARD_TIME, LIFE_TIME_FACTOR)


class Supervision:
    """Calls `on_lost(code, detail)` at an error, `on_return(code)` at its end.

    `on_routes` is called when what the node receives or expects has changed.
    """

    def __init__(
        self,
        dictionary: Dictionary,
        clock: Clock,
        on_lost: Callable[[int, bytes], None],
        on_return: Callable[[int], None],
        on_routes: Callable[[], None],
    ) -> None:
        self.sync = SyncConsumer(
            dictionary, clock, lambda: on_lost(emcy.SYNC_MISSING, b""), lambda: on_return(emcy.SYNC_MISSING)
        )
        self.guarding = NodeGuarding(
            dictionary,
            clock,
            lambda: on_lost(emcy.HEARTBEAT_LOST, b""),
            lambda: on_return(emcy.HEARTBEAT_LOST),
        )
        self.time = TimeConsumer(dictionary, clock)
        self.emergencies = EmergencyConsumer(
            dictionary,
            lambda node, code: on_lost(emcy.NEIGHBOUR, bytes((node, *code.to_bytes(2, "little")))),
            lambda: on_return(emcy.NEIGHBOUR),
        )
        self._on_routes = on_routes
        self.due_us = NEVER_US
        for index in SYNC_OBJECTS:
            dictionary.followers[index] = self._follow_sync
        for index in GUARDING_OBJECTS:
            dictionary.followers[index] = lambda _sub: self.reset_guarding()
        dictionary.followers[TIME] = lambda _sub: on_routes()
        dictionary.followers[CONSUMED] = lambda _sub: self._follow_emergencies()

    def reset(self) -> None:
        """Start again with the present values of the objects: after a reset."""
        self.sync.follow()
        self.emergencies.follow()
        self.reset_guarding()

    def reset_guarding(self) -> None:
        """Disarm node guarding until the next remote frame of the master."""
        self.guarding.reset()
        self._update()

    def on_sync(self) -> None:
        """Serve a SYNC, after the time has advanced to it."""
        self.sync.on_sync()
        self._update()

    def guarded(self, state: int) -> bytes | None:
        """Return the answer to the master's remote frame, None where there is none."""
        answer = self.guarding.answer(state)
        self._update()
        return answer

    def routes(self) -> Iterator[tuple[int, Callable[[bytes], None]]]:
        """Yield the identifiers that these services receive, each with its handler."""
        if self.time.cob_id is not None:
            yield self.time.cob_id, self.time.on_time
        for cob_id, node in self.emergencies.cob_ids.items():
            yield cob_id, partial(self.emergencies.on_emergency, node)

    def run(self) -> None:
        """Report what is overdue: SYNC or guarding."""
        self.sync.run()
        self.guarding.run()
        self._update()

    def _follow_sync(self, _subindex: int) -> None:
        self.sync.follow()
        self._update()
        self._on_routes()

    def _follow_emergencies(self) -> None:
        self.emergencies.follow()
        self._on_routes()

    def _update(self) -> None:
        self.due_us = min(self.sync.due_us, self.guarding.due_us)
