"""Slipped coupling: the motor turns while the table hardly follows.

Law: stiffness and damping of `drive_compliance` are multiplied by `passed`.
Confused with: broken_scale, where the readings also drift apart -> here the motor has lost the table's mass.
"""

from typing import Annotated, NamedTuple

from hil_sim.faults.fault_target import FaultError, FaultTarget
from kernels.quantities import Quantity


class Params(NamedTuple):
    """Remaining share of the coupling's stiffness and damping."""

    passed: Annotated[float, Quantity("", 0.0, 1.0, "remaining share of stiffness and damping")] = 1e-4


def check(target: FaultTarget, _p: Params) -> None:
    """Raise FaultError if motor and table are one mass."""
    if not target.params["drive_compliance"]["enabled"]:
        raise FaultError(f"axis {target.name} has no drive_compliance: motor and table are one mass")


def begin(target: FaultTarget, p: Params) -> None:
    """Reduce stiffness and damping of the coupling permanently."""
    compliance = target.params["drive_compliance"]
    compliance["stiffness_n_m"] *= p.passed
    compliance["damping_n_s_m"] *= p.passed
