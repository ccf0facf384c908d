"""Limit switch: it closes where it should not, by a chip in it or a broken wire.

The drive sees it in 60FDh (bit 0 negative, bit 1 positive side), brakes, and goes no further to that side.
"""

from typing import Annotated, NamedTuple

from hil_sim.faults.fault_target import FaultTarget
from kernels.quantities import Quantity


class Params(NamedTuple):
    """Which of the two."""

    side: Annotated[float, Quantity("", -1.0, 1.0, "positive or negative switch")] = 1.0


def begin(target: FaultTarget, p: Params) -> None:
    """The switch closes and stays closed."""
    target.drive.port.close_switch(positive=p.side > 0.0)
