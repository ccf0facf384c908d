"""Limit switch: it closes within the travel because of a metal chip or a broken wire.

The drive reads it in 60FDh (bit 0 negative, bit 1 positive side), brakes, and moves no further to that side.
"""

from typing import Annotated, NamedTuple

from hil_sim.faults.fault_target import FaultTarget
from kernels.quantities import Quantity


class Params(NamedTuple):
    """The side of the switch."""

    side: Annotated[float, Quantity("", -1.0, 1.0, "positive or negative switch")] = 1.0


def begin(target: FaultTarget, p: Params) -> None:
    """Close the switch permanently."""
    target.drive.port.close_switch(positive=p.side > 0.0)
