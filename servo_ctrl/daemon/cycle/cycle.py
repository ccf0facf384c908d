"""The cycle: SYNC -> inputs of all nodes -> tick -> RPDOs, repeated. It runs in callbacks, without a task.

In real time a clock calls `begin` every period. In lockstep the next SYNC follows the RPDOs at once:
simulated time counts SYNCs, and no process waits for the wall clock.
"""

from collections.abc import Callable, Sequence
from typing import Protocol

Inputs = list[bytes | None]
"""The TPDO data of each node in one cycle; None = missing."""
RESPONDING_CYCLES = 2
"""Bounds the cycles since its last frame in which a node that is not expected responds; chosen."""
LATE_CYCLES_MAX = 1000
"""Bounds the cycles after a miss in which late inputs may still arrive, several at once; chosen."""
REPEATS_TOLERATED = 3
"""Bounds the consecutive cycles with a repeated frame: CAN delivers a frame twice after an error in
the last bit of its end of frame (ISO 11898-1); chosen."""


class Sender(Protocol):
    """Sends a payload in frames of one CAN identifier."""

    def send(self, payload: bytes) -> None:
        """Queue a frame with this payload for the next flush."""


class TickHandler(Protocol):
    """Turns the inputs of a cycle into its RPDOs; see `daemon.cycle.machine.MachineController`."""

    def tick(self, cycle: int, elapsed: int, inputs: Inputs) -> list[bytes] | None:
        """Return RPDO payloads for this cycle's inputs (None = missing); None when the machine is off."""

    def input_missing(self, node: int) -> bool:
        """Count a node's missing inputs in this cycle; return whether the cycle stops expecting the node."""

    def duplicate_input(self, node: int) -> None:
        """Report that a node's inputs arrived twice: another participant sends them too."""

    def wrong_input_length(self, node: int, size: int) -> None:
        """Report a TPDO of a node whose `size` in bytes contradicts its mapping."""


class RoundTripTrial(Protocol):
    """Measures the first cycles; see `daemon.run.round_trip`."""

    def sync_sent(self) -> None:
        """Note that a SYNC was sent."""

    def cycle_complete(self, inputs: Inputs) -> bool:
        """Take the inputs of the cycle (None = missing); return whether to measure the next cycle too."""


class Cycle:
    """Decides which nodes must answer a SYNC. `number` is the current cycle, -1 before the first."""

    def __init__(
        self,
        core: TickHandler,
        sync: Sender,
        rpdos: Sequence[Sender],
        sizes: Sequence[int],
        flush: Callable[[], None],
        read: Callable[[], object],
        *,
        lockstep: bool,
        on_begin: Callable[[int], None],
        on_end: Callable[[], None],
    ) -> None:
        self.number = -1
        self.running = True
        self.waiting = 0
        """Bit k is set while the inputs of node k have not arrived."""
        self.open = False
        """True from a SYNC until its RPDOs are sent; until the next SYNC where no node is expected."""
        self.trial: RoundTripTrial | None = None
        self._core, self._sync, self._rpdos, self._lockstep = core, sync, tuple(rpdos), lockstep
        self._flush, self._read, self._on_begin, self._on_end = flush, read, on_begin, on_end
        self._sizes = tuple(sizes)
        self._expected = (1 << len(self._sizes)) - 1
        self._inputs: Inputs = [None] * len(self._sizes)
        self._elapsed = 1
        nodes = len(self._sizes)
        self._responded_at = [-RESPONDING_CYCLES - 2] * nodes
        """By node: the last cycle in which its frame arrived while it was not expected."""
        self._previous_inputs: Inputs = [None] * nodes
        """Inputs of the previous cycle."""
        self._pending_late_frames = [0] * nodes
        self._late_until = [-1] * nodes
        self._any_late_until = -1
        """By node: how many late frames may still arrive, and until which cycle; the latest such cycle."""
        self._repeated_at = [-2] * nodes
        self._repeats = [0] * nodes
        """By node: the last cycle with a surplus frame, and how many consecutive cycles had one."""

    def begin(self, elapsed: int = 1) -> None:
        """Start a cycle `elapsed` periods after the last one; first complete a cycle that is still open."""
        if self.open:
            self._read()  # inputs that arrived while this process was late were in time
        if self.open:
            self.complete_without_missing()
        if not self.running:
            return
        self.number += elapsed
        self._elapsed = elapsed
        self.waiting, self.open = self._expected, True
        self._previous_inputs, self._inputs = self._inputs, [None] * len(self._sizes)
        self._sync.send(b"")
        self._flush()
        if self.trial is not None:
            self.trial.sync_sent()
        self._on_begin(elapsed)

    def handler(self, node: int) -> Callable[[bytes, float], None]:
        """Make the handler of a node's TPDO."""
        bit, size = 1 << node, self._sizes[node]

        def on_tpdo(payload: bytes, _timestamp_s: float) -> None:
            if len(payload) != size:
                self._core.wrong_input_length(node, len(payload))
            elif self.waiting & bit:
                self._inputs[node] = payload
                self.waiting ^= bit
                if not self.waiting:
                    self._complete()
            elif self._expected & bit:
                self._handle_extra_frame(node, payload)
            else:
                self._responded_at[node] = self.number

        return on_tpdo

    def _handle_extra_frame(self, node: int, data: bytes) -> None:
        """Classify a surplus frame: late, delivered twice by CAN, or sent by another participant."""
        if self.number < 0 or not self.running:
            return
        if self.input_age(node):
            self._pending_late_frames[node] -= 1
            return
        consecutive = self.number - self._repeated_at[node] <= 1
        self._repeats[node] = self._repeats[node] + 1 if consecutive else 1
        self._repeated_at[node] = self.number
        may_be_repeated = self._inputs[node] in (data, self._previous_inputs[node])
        if not may_be_repeated or self._repeats[node] > REPEATS_TOLERATED:
            self._core.duplicate_input(node)

    def responding(self, node: int) -> bool:
        """Whether a node that is not expected to answer has done so lately."""
        return self.number - self._responded_at[node] <= RESPONDING_CYCLES

    def input_age(self, *nodes: int) -> int:
        """Return how many cycles old the last inputs of these nodes may be: late frames to come."""
        ages = (self._pending_late_frames[node] for node in nodes if self.number <= self._late_until[node])
        return min(max(ages, default=0), LATE_CYCLES_MAX)  # lost frames do not accumulate without bound

    @property
    def inputs_late(self) -> bool:
        """Whether the inputs of any node may be old."""
        return self.number <= self._any_late_until

    def expect(self, node: int) -> None:
        """Expect a node that was given up to answer again from the next SYNC on."""
        self._expected |= 1 << node
        self._note_late(node)  # its first answer may have arrived after its cycle

    def complete_without_missing(self) -> None:
        """Complete the cycle without the inputs that have not arrived."""
        for node in range(len(self._sizes)):
            if self.waiting >> node & 1:
                self._note_late(node)
                if self._core.input_missing(node):
                    self._expected &= ~(1 << node)
        self.waiting = 0
        self._complete()

    def _note_late(self, node: int) -> None:
        late = self.number > self._late_until[node]
        self._pending_late_frames[node] = 1 if late else self._pending_late_frames[node] + 1
        self._late_until[node] = self._any_late_until = self.number + LATE_CYCLES_MAX

    def stop(self) -> None:
        """Send no further SYNC."""
        if self.running:
            self.running = self.open = False
            self.waiting = 0
            self._on_end()

    def _complete(self) -> None:
        self.open = False
        if self.trial is not None and not self.trial.cycle_complete(self._inputs):
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
