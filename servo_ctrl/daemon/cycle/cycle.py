"""The cycle: SYNC -> inputs of all nodes -> tick -> RPDOs, and again. Callbacks only, no task in the path.

One object for both kinds of time. In real time a clock calls `begin` every period. In lockstep the next
SYNC goes out as soon as the RPDOs are sent: simulated time is SYNC, and nobody waits for the wall clock.
"""

from collections.abc import Callable, Sequence
from typing import Protocol

Inputs = list[bytes | bytearray | None]
"""Of a cycle, by node: the data of its TPDO, None = missing."""
RESPONDING_WITHIN = 2
"""A node that answered within so many cycles is responding; chosen."""
LATE_WITHIN = 1000
"""Cycles in which inputs that did not come in time may still come, several at once; chosen."""
REPEATS_TOLERATED = 3
"""Cycles in a row with a frame that CAN may have delivered twice (an error in the last bit of its end of
frame, ISO 11898-1); chosen."""


class Sender(Protocol):
    """A frame that can be sent with a payload."""

    def send(self, payload: bytes) -> None:
        """Send it with the next flush."""


class Core(Protocol):
    """What a cycle computes; see `daemon.cycle.machine.MachineController`."""

    def tick(self, cycle: int, elapsed: int, inputs: Inputs) -> list[bytes] | None:
        """RPDO payloads for the inputs of this cycle (None = missing); None when the machine is off."""

    def input_missing(self, node: int) -> bool:
        """A node's inputs of this cycle did not come; True: stop expecting it."""

    def input_twice(self, node: int) -> None:
        """Inputs of a node came twice: another participant sends them too."""

    def input_of_other_length(self, node: int, size: int) -> None:
        """Inputs of a node came with so many bytes, which its mapping does not have."""


class Trial(Protocol):
    """Looks at the first cycles; see `daemon.run.round_trip`."""

    def begun(self) -> None:
        """A SYNC went out."""

    def answered(self, inputs: Inputs) -> bool:
        """The inputs are there, or given up; True: the next cycle is looked at too."""


class Cycle:
    """Owns who is expected to answer a SYNC. `number` is the current cycle, -1 before the first."""

    def __init__(
        self,
        core: Core,
        sync: Sender,
        rpdos: Sequence[Sender],
        sizes: Sequence[int],
        flush: Callable[[], None],
        *,
        lockstep: bool,
        on_begin: Callable[[int], None],
        on_end: Callable[[], None],
    ) -> None:
        self.number = -1
        self.running = True
        self.waiting = 0
        """Bit k: the inputs of node k are still to come."""
        self.open = False
        """A SYNC went out and what follows from it did not; where no node is expected, until the next one."""
        self.trial: Trial | None = None
        self._core, self._sync, self._rpdos, self._lockstep = core, sync, tuple(rpdos), lockstep
        self._flush, self._on_begin, self._on_end = flush, on_begin, on_end
        self._sizes = tuple(sizes)
        self._expected = (1 << len(self._sizes)) - 1
        self._inputs: Inputs = [None] * len(self._sizes)
        self._elapsed = 1
        nodes = len(self._sizes)
        self._answered_at = [-RESPONDING_WITHIN - 2] * nodes
        """The last cycle in which a node that is not expected answered."""
        self._before: Inputs = [None] * nodes
        """Inputs of the cycle before."""
        self._owed = [0] * nodes
        self._owed_until = [-1] * nodes
        self._owing_until = -1
        """So many frames more may come, up to this cycle: those of cycles which went on without them."""
        self._repeated_at = [-2] * nodes
        self._repeats = [0] * nodes
        """Cycles in a row with a frame more than there should be, and the last of them."""

    def begin(self, elapsed: int = 1) -> None:
        """Start a cycle, `elapsed` periods after the last one; first settles one that is still open."""
        if self.open:
            self.complete_without()
        if not self.running:
            return
        self.number += elapsed
        self._elapsed = elapsed
        self.waiting, self.open = self._expected, True
        self._before, self._inputs = self._inputs, [None] * len(self._sizes)
        self._sync.send(b"")
        self._flush()
        if self.trial is not None:
            self.trial.begun()
        self._on_begin(elapsed)

    def handler(self, node: int) -> Callable[[bytearray, float], None]:
        """The handler of a node's TPDO."""
        bit, size = 1 << node, self._sizes[node]

        def on_tpdo(payload: bytearray, _timestamp_s: float) -> None:
            if len(payload) != size:
                self._core.input_of_other_length(node, len(payload))
            elif self.waiting & bit:
                self._inputs[node] = payload
                self.waiting ^= bit
                if not self.waiting:
                    self._complete()
            elif self._expected & bit:
                self._take_another(node, payload)
            else:
                self._answered_at[node] = self.number

        return on_tpdo

    def _take_another(self, node: int, data: bytearray) -> None:
        """Take one frame too many: a late one, one that CAN delivered twice, or another node's."""
        if self.number < 0 or not self.running:
            return
        if self.age(node):
            self._owed[node] -= 1
            return
        in_a_row = self.number - self._repeated_at[node] <= 1
        self._repeats[node] = self._repeats[node] + 1 if in_a_row else 1
        self._repeated_at[node] = self.number
        maybe_repeated = self._inputs[node] in (data, self._before[node])
        if not maybe_repeated or self._repeats[node] > REPEATS_TOLERATED:
            self._core.input_twice(node)

    def responding(self, node: int) -> bool:
        """Whether a node that is not expected to answer does so."""
        return self.number - self._answered_at[node] <= RESPONDING_WITHIN

    def age(self, *nodes: int) -> int:
        """How many cycles old the last inputs of these nodes may be: so many more are still to come."""
        ages = (self._owed[node] for node in nodes if self.number <= self._owed_until[node])
        return min(max(ages, default=0), LATE_WITHIN)  # lost frames do not add up for ever

    @property
    def owing(self) -> bool:
        """Whether the inputs of any node may be old."""
        return self.number <= self._owing_until

    def expect(self, node: int) -> None:
        """From the next SYNC on a node that was given up is one of those that answer."""
        self._expected |= 1 << node
        self._owe(node)  # the frame that it answered with may have come behind its cycle

    def complete_without(self) -> None:
        """Go on without the inputs that have not come."""
        for node in range(len(self._sizes)):
            if self.waiting >> node & 1:
                self._owe(node)
                if self._core.input_missing(node):
                    self._expected &= ~(1 << node)
        self.waiting = 0
        self._complete()

    def _owe(self, node: int) -> None:
        late = self.number > self._owed_until[node]
        self._owed[node] = 1 if late else self._owed[node] + 1
        self._owed_until[node] = self._owing_until = self.number + LATE_WITHIN

    def stop(self) -> None:
        """No further SYNC."""
        if self.running:
            self.running = self.open = False
            self.waiting = 0
            self._on_end()

    def _complete(self) -> None:
        self.open = False
        if self.trial is not None and not self.trial.answered(self._inputs):
            self.trial = None
        payloads = self._core.tick(self.number, self._elapsed, self._inputs)
        if payloads is None:
            self.stop()
            return
        for rpdo, payload in zip(self._rpdos, payloads, strict=True):
            rpdo.send(payload)
        if self._lockstep:
            self.begin()
        else:
            self._flush()
