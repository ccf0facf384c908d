"""Drive compliance: motor and table as two masses with the screw's stiffness and damping between them.

Law: F = k d + c dd/dt, d the motor position (through the screw) minus the table position.
Source: Xia et al., equations (4) and (5), k (Kbs theta - x) in linear units; the damping is ours (material
    and joints).
Symbols: F force from screw to table N; k `stiffness_n_m` N/m; c `damping_n_s_m` N s/m; d deflection m.
Valid: the first axial or torsional mode of the feed drive; a screw's k falls with the nut's distance from
    its bearing. Without the section motor and table are one mass.
Confused with: backlash -> encoder minus scale over force is a slope here and a step there; sampling lag ->
    repeat at another speed: lag grows with the speed.
"""

from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.COUPLING


class Params(NamedTuple):
    """Spring and damper of the drive train."""

    stiffness_n_m: Annotated[float, Quantity("N/m", 1.0, 1e9, "axial stiffness k", "N/um")]
    damping_n_s_m: Annotated[float, Quantity("N s/m", 0.0, 1e5, "damping c")]


NEUTRAL = None
"""No values make a spring rigid: without the section motor and table are one mass."""


@kernel
def force_n(p: Any, deflection_m: float, rate_m_s: float) -> float:
    """Return the force from screw to table (N)."""
    return float(p.stiffness_n_m * deflection_m + p.damping_n_s_m * rate_m_s)
