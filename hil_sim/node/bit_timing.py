"""Bit rates of nodes and bus, as LSS switches them.

The bench has no wire, so the nodes define the rate of its bus: at power-up it is that of most of them, later
that of the nodes which LSS switches, as their master switches with them. A node at another rate neither sends
nor receives; the error frames that it would send on a wire are not simulated.
"""

from dataclasses import dataclass

from hil_sim.node.nmt import NEVER_US

BUS_KBIT_S = 1000
"""Rate of a node to which LSS has assigned none."""


@dataclass(slots=True)
class BusRate:
    """Rate of the bench's bus (kbit/s), shared by its nodes."""

    kbit_s: int = BUS_KBIT_S


class NodeRate:
    """Rate of one node: at power-up the stored one."""

    def __init__(self, bus: BusRate, stored_kbit_s: int | None) -> None:
        self._bus = bus
        self._delay_us = 0
        self._next: int | None = None
        self.kbit_s = BUS_KBIT_S if stored_kbit_s is None else stored_kbit_s
        self.due_us = NEVER_US

    @property
    def is_off_bus(self) -> bool:
        """Whether it neither sends nor receives: at another rate than the bus, or while the rate changes."""
        return self.due_us != NEVER_US or self.kbit_s != self._bus.kbit_s

    def switch(self, kbit_s: int, delay_ms: int, now_us: int) -> None:
        """Switch to a rate after the master's delay, and send nothing for another delay (CiA 305)."""
        self._next, self._delay_us = kbit_s, 1000 * delay_ms
        self.due_us = now_us + self._delay_us

    def run(self, now_us: int) -> None:
        """Carry out the switch when it is due, and end the silence after it."""
        if self._next is not None and now_us >= self.due_us:
            self.kbit_s = self._bus.kbit_s = self._next
            self._next = None
            self.due_us += self._delay_us
        if self._next is None and now_us >= self.due_us:
            self.due_us = NEVER_US
