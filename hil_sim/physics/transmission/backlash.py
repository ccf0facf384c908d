"""Backlash: free travel between nut and screw.

Law: the elastic contact acts on the deflection beyond the backlash gap, d = gap - b for gap > b, gap + b for
    gap < -b, else 0; it pushes and never pulls. For a stiff contact and slow motion the table follows
    equation (9): x_out = x_in - b moving forwards, x_in + b moving backwards, else unchanged.
Source: Xia et al., equation (9); elastic form as in Nordin and Gutman (2002), section 2.
Symbols: gap motor minus table position m; b `play_m` half of the backlash gap m; d contact deflection m.
Valid: needs drive_compliance (the contact's stiffness), whose damping gives the impact losses.
Confused with: drive_compliance -> backlash steps encoder minus scale after a reversal at any force;
    presliding_hysteresis -> a loop in force, while encoder minus scale stays constant.
"""

from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.GAP
NEEDS = "drive_compliance"


class Params(NamedTuple):
    """Half of the backlash gap."""

    play_m: Annotated[float, Quantity("m", 0.0, 1e-2, "half of the backlash gap b", "um")]


NEUTRAL = Params(play_m=0.0)


@kernel
def deflection_m(p: Any, gap_m: float) -> float:
    """Return the deflection of the contact (m); zero inside the backlash gap."""
    if gap_m > p.play_m:
        return float(gap_m - p.play_m)
    if gap_m < -p.play_m:
        return float(gap_m + p.play_m)
    return 0.0


@kernel
def contact_force_n(p: Any, force: float, deflection: float) -> float:
    """Return the force (N) of spring and damper that the contact transmits: it pushes and never pulls."""
    if p.play_m > 0.0 and force * deflection <= 0.0:
        return 0.0
    return force
