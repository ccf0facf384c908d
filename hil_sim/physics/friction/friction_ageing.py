"""Friction ageing: wear changes friction with the distance travelled.

Law: f = max(0, 1 + r d), one r for the levels, one for the damping;  dd/dt = |v|.
Source: Archard (1953), wear in proportion to the sliding distance at a constant load; that friction follows
    the wear in proportion is its first-order term (chosen).
Symbols: f factor on friction; d `travelled_m` distance travelled since power-up m; r `level_1_m` and
    `damping_1_m` 1/m, positive if surfaces roughen, negative if preload wears off; v m/s.
Valid: small changes at constant load and lubricant; during the first kilometres of a new axis (running-in)
    friction falls faster.
Confused with: temperature_dependent_friction, also a drift with use -> let the axis cool and repeat;
    lubrication_loss -> continues at rest.
"""

from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.FRICTION_CHANGE
NEEDS = "coulomb_friction"
ORDER = 3  # place in the product of the factors


class Params(NamedTuple):
    """Change per distance."""

    level_1_m: Annotated[float, Quantity("1/m", -1.0, 1.0, "growth of the friction levels", "1/km")]
    damping_1_m: Annotated[float, Quantity("1/m", -1.0, 1.0, "growth of the viscous damping", "1/km")]


class State(NamedTuple):
    """Distance since power-up (m)."""

    travelled_m: float = 0.0


NEUTRAL = Params(level_1_m=0.0, damping_1_m=0.0)


@kernel
def factors(p: Any, s: Any, _time_s: float) -> tuple[float, float]:
    """Return the factors on the friction levels and on the damping."""
    level, damping = 1.0 + p.level_1_m * s.travelled_m, 1.0 + p.damping_1_m * s.travelled_m
    return float(max(0.0, level)), float(max(0.0, damping))


@kernel
def advance(_p: Any, s: Any, _friction_w: float, speed_m_s: float, dt_s: float) -> None:
    """Add the distance of a substep."""
    s.travelled_m += speed_m_s * dt_s
