"""Cross-axis coupling: the scale reading depends on the position of another axis (squareness, straightness).

Law: e = q xo + b xo^2.
Source: mismatch catalogue, entry cross_axis_coupling; location errors C0Z and straightness EYX of ISO 230-1.
Symbols: e error of the reading m; xo measured point of the axis `other` from the machine's zero m; q
    `squareness` angle between the guides minus a right angle rad; b `bow_1_m` bow of the other guide 1/m.
Valid: small angles. It shifts the reading, not the table: the axes exert no force on each other.
Confused with: lead_error_cumulative or thermal_expansion if both axes always move together -> move them one
    after the other.
"""

from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.CROSS_READING


class Params(NamedTuple):
    """The other axis, and the squareness and straightness of its guide."""

    other: Annotated[float, Quantity("", 0.0, 15.0, "the other axis", "axis")]
    squareness: Annotated[float, Quantity("", -1e-1, 1e-1, "squareness q", "um/m")] = 0.0
    bow_1_m: Annotated[float, Quantity("1/m", -1e-1, 1e-1, "straightness b", "um/m2")] = 0.0


class State(NamedTuple):
    """Position of the other axis (m) at the end of the last call."""

    other_position_m: float = 0.0


NEUTRAL = Params(other=0.0)


@kernel
def error_m(p: Any, s: Any) -> float:
    """Return the error of the reading (m) for the last position of the other axis."""
    return float(s.other_position_m * (p.squareness + p.bow_1_m * s.other_position_m))
