"""The cycle: SYNC -> inputs of all nodes -> tick -> RPDOs, and again. Callbacks only, no task in the path.

One object for both kinds of time. In real time a clock calls `begin` every period. In lockstep the next
SYNC goes out as soon as the RPDOs are sent: simulated time is SYNC, and nobody waits for the wall clock.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    import struct
    from collections.abc import Callable, Sequence

    Inputs = list[tuple[int, ...] | None]


HEARD_WITHIN = 2
"""Cycles since an answer, to call a node heard."""


class Sender(Protocol):
    """A frame that can be sent with a payload."""

    def send(self, payload: bytes) -> None:
        """Send it now."""


class Core(Protocol):
    """What a cycle computes; see `daemon.machine.Machine`."""

    def tick(self, cycle: int, elapsed: int, inputs: Inputs) -> list[bytes] | None:
        """RPDO payloads for the inputs of this cycle (None = missing); None when the machine is off."""

    def input_missing(self, node: int) -> bool:
        """A node's inputs of this cycle did not come; True: stop expecting it."""


class Cycle:
    """Owns who is expected to answer a SYNC. `number` is the current cycle, -1 before the first."""

    def __init__(
        self,
        core: Core,
        sync: Sender,
        rpdos: Sequence[Sender],
        layouts: Sequence[struct.Struct],
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
        self._core, self._sync, self._rpdos, self._lockstep = core, sync, tuple(rpdos), lockstep
        self._on_begin, self._on_end = on_begin, on_end
        self._layouts = tuple(layouts)
        self._expected = (1 << len(self._layouts)) - 1
        self._inputs: Inputs = [None] * len(self._layouts)
        self._elapsed = 1
        self._heard = [-HEARD_WITHIN - 2] * len(self._layouts)
        """The last cycle in which a node that is not expected was heard."""

    def begin(self, elapsed: int = 1) -> None:
        """Start a cycle, `elapsed` periods after the last one; first settles one that is still open."""
        if self.open:
            self.complete_without()
        if not self.running:
            return
        self.number += elapsed
        self._elapsed = elapsed
        self.waiting, self.open = self._expected, True
        self._inputs = [None] * len(self._layouts)
        self._sync.send(b"")
        self._on_begin(elapsed)

    def handler(self, node: int) -> Callable[[bytearray, float], None]:
        """The handler of a node's TPDO."""
        bit, layout = 1 << node, self._layouts[node]

        def on_tpdo(payload: bytearray, _timestamp_s: float) -> None:
            if self.waiting & bit and len(payload) == layout.size:
                self._inputs[node] = layout.unpack(payload)
                self.waiting ^= bit
                if not self.waiting:
                    self._complete()
            elif not self._expected & bit and len(payload) == layout.size:
                self._heard[node] = self.number

        return on_tpdo

    def hears(self, node: int) -> bool:
        """Whether a node that is not expected to answer does so."""
        return self.number - self._heard[node] <= HEARD_WITHIN

    def expect(self, node: int) -> None:
        """From the next SYNC on a node that was given up is one of those that answer."""
        self._expected |= 1 << node

    def complete_without(self) -> None:
        """Go on without the inputs that have not come."""
        for node in range(len(self._layouts)):
            if self.waiting >> node & 1 and self._core.input_missing(node):
                self._expected &= ~(1 << node)
        self.waiting = 0
        self._complete()

    def stop(self) -> None:
        """No further SYNC."""
        if self.running:
            self.running = self.open = False
            self.waiting = 0
            self._on_end()

    def _complete(self) -> None:
        self.open = False
        payloads = self._core.tick(self.number, self._elapsed, self._inputs)
        if payloads is None:
            self.stop()
            return
        for rpdo, payload in zip(self._rpdos, payloads, strict=True):
            rpdo.send(payload)
        if self._lockstep:
            self.begin()
