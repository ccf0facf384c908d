"""Death of a node: it stops sending and acting from one cycle to the next.

The node is the drive of the axis, whose motor then coasts, or with `scale` its linear scale.
Confused with: a lost frame -> after a death no frame follows, not even a heartbeat.
"""

from typing import Annotated, NamedTuple

from hil_sim.faults.fault_target import FaultError, FaultTarget
from kernels.quantities import Quantity


class Params(NamedTuple):
    """The node of the axis."""

    scale: Annotated[float, Quantity("", 0.0, 1.0, "1 = the scale dies, 0 = the drive")] = 0.0


def check(target: FaultTarget, p: Params) -> None:
    """Raise FaultError if the scale is to die and the axis has none."""
    if p.scale and target.scale is None:
        raise FaultError(f"axis {target.name} has no scale")


def begin(target: FaultTarget, p: Params) -> None:
    """Stop the node permanently."""
    if p.scale and target.scale is not None:
        target.scale.slave.die()
        return
    target.drive.motion.switch_off()
    target.drive.slave.die()
