"""Node guarding (CiA 301, 7.2.8.3.2): answers the master's remote frames, and supervises the master by them.

The life time is 100Ch times 100Dh; the first remote frame starts it. A node with a heartbeat (1017h) has no
node guarding.
"""

from collections.abc import Callable

from hil_sim.node.dictionary import Dictionary
from hil_sim.node.nmt import NEVER_US, Clock

GUARD_TIME, LIFE_TIME_FACTOR, HEARTBEAT = 0x100C, 0x100D, 0x1017
TOGGLE = 0x80


class NodeGuarding:
    """Calls `on_lost()` once when the life time is over, `on_return()` at the next remote frame."""

    def __init__(
        self, dictionary: Dictionary, clock: Clock, on_lost: Callable[[], None], on_return: Callable[[], None]
    ) -> None:
        self._dictionary = dictionary
        self._clock = clock
        self._on_lost = on_lost
        self._on_return = on_return
        self._lost = False
        self._toggle = 0
        self.due_us = NEVER_US

    def reset(self) -> None:
        """Start again with toggle bit 0: after a reset, and when a client writes the times."""
        self._toggle = 0
        self.due_us = NEVER_US
        self._recover()

    def answer(self, state: int) -> bytes | None:
        """Return the answer to a remote frame; None where the node sends heartbeats."""
        value = self._dictionary.value
        if value(HEARTBEAT):
            return None
        life_time_us = 1000 * value(GUARD_TIME) * value(LIFE_TIME_FACTOR)
        self.due_us = self._clock.now_us + life_time_us if life_time_us else NEVER_US
        self._recover()
        shown = state | self._toggle
        self._toggle ^= TOGGLE
        return bytes((shown,))

    def run(self) -> None:
        """Report that the life time is over: the master guards no longer."""
        if self._clock.now_us >= self.due_us:
            self.due_us = NEVER_US
            self._lost = True
            self._on_lost()

    def _recover(self) -> None:
        if self._lost:
            self._lost = False
            self._on_return()
