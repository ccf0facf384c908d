"""What a slave is connected to: the bench that hosts it, and the device whose objects it carries."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple, Protocol

from hil_sim.node.bit_timing import BusRate
from hil_sim.node.lss_slave import UNNAMED
from hil_sim.node.nmt import Clock

FIRST_SERIAL, FIRST_UNNAMED_SERIAL = 0x0001_0000, 0x0001_0100
"""Serial numbers count from here, so that no two devices of a bench share one: by node id, or by the place in
the plant file of devices without a node id.
"""


class NodeHost(NamedTuple):
    """What all nodes of a bench share."""

    clock: Clock
    send: Callable[[int, bytes], None]
    """Sends a frame (identifier, data) on the bus."""
    state_directory: Path | None
    """Directory of the stored parameters; None keeps them in memory only."""
    unnamed: Iterator[int]
    """Counts the devices without a node id."""
    bus_rate: BusRate

    def serial_of(self, node_id: int) -> int:
        """Return the serial number of the next device, whose node id in the plant file this is."""
        return FIRST_UNNAMED_SERIAL + next(self.unnamed) if node_id == UNNAMED else FIRST_SERIAL + node_id


class Device(Protocol):
    """The device of a slave; `profile` is the number of its CiA profile."""

    profile: int

    def factory_settings(self) -> None:
        """Write the values that depend on the hardware over the defaults of the EDS."""

    def reset(self) -> None:
        """Reset the device after power-up or a reset of the node."""

    def process(self) -> None:
        """Act on changed process objects."""

    def connection_lost(self, code: int) -> None:
        """React to a lost master (`code`: the error), or to one that stopped or reset the node (0)."""

    def is_idle(self) -> bool:
        """Whether parameters may be stored and restored now."""

    def manufacturer_status(self) -> int:
        """Return the upper 16 bits of the manufacturer status register 1002h."""
