"""Bit rates of nodes and bus: what LSS switches, and who hears whom.

The bench has no wire, so the rate of its bus is what the nodes say: at power-up that of most of them, and
then that of the nodes which LSS switches, as their master does. A node that was left at another rate hears
nothing and is not heard; the error frames that it would send on a wire are not simulated.
"""

from dataclasses import dataclass

from hil_sim.node.nmt import NEVER_US

BUS_KBIT_S = 1000
"""Of a node that nobody has told another."""


@dataclass(slots=True)
class BusRate:
    """Rate of the bench's bus (kbit/s), shared by its nodes."""

    kbit_s: int = BUS_KBIT_S


class NodeRate:
    """Rate of one node, from power-up on the stored one."""

    def __init__(self, bus: BusRate, stored_kbit_s: int | None) -> None:
        self._bus = bus
        self._delay_us = 0
        self._next: int | None = None
        self.kbit_s = BUS_KBIT_S if stored_kbit_s is None else stored_kbit_s
        self.due_us = NEVER_US

    @property
    def deaf(self) -> bool:
        """Whether it neither hears nor is heard: at another rate than the bus, or while the rate changes."""
        return self.due_us != NEVER_US or self.kbit_s != self._bus.kbit_s

    def switch(self, kbit_s: int, delay_ms: int, now_us: int) -> None:
        """Take a rate after the master's delay, and be silent as long again."""
        self._next, self._delay_us = kbit_s, 1000 * delay_ms
        self.due_us = now_us + self._delay_us

    def run(self, now_us: int) -> None:
        """Do what is due: the switch, or the end of the silence behind it."""
        if self._next is not None and now_us >= self.due_us:
            self.kbit_s = self._bus.kbit_s = self._next
            self._next = None
            self.due_us += self._delay_us
        if self._next is None and now_us >= self.due_us:
            self.due_us = NEVER_US
