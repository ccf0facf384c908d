"""Death of a node: from one cycle to the next it says nothing and does nothing any more.

The drive of the axis, whose motor coasts then; or with `scale` its linear scale.
Confused with: a lost frame -> nothing follows, no heartbeat either.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, NamedTuple

from hil_sim.faults.struck import FaultError
from hil_sim.physics.quantities import Quantity

if TYPE_CHECKING:
    from hil_sim.faults.struck import Struck


class Params(NamedTuple):
    """Which node of the axis."""

    scale: Annotated[float, Quantity("", 0.0, 1.0, "1 = the scale dies, 0 = the drive")] = 0.0


def check(struck: Struck, p: Params) -> None:
    """Raises FaultError where the axis has no scale to die."""
    if p.scale and struck.scale is None:
        raise FaultError(f"axis {struck.name} has no scale")


def begin(struck: Struck, p: Params) -> None:
    """It is gone."""
    if p.scale and struck.scale is not None:
        struck.scale.slave.die()
        return
    struck.drive.motion.switch_off()
    struck.drive.slave.die()
