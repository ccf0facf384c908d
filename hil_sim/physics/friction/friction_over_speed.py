"""Table of friction over speed: a measured curve without a known law, the same in both directions.

Law: level += T(|v|), T linear over the logarithm of the speed between points evenly spaced over it from v1
    to v2, constant beyond them; the sum of the levels is never below zero.
Source: a look-up table; the curve of Stribeck (1902) has a logarithmic speed axis because a lubricant film
    changes over decades of the speed.
Symbols: T `level_n` N, its first `points` values; v velocity m/s; v1 `first_m_s` m/s; v2 `last_m_s` m/s.
Valid: at the speeds where it was identified.
Confused with: stribeck_friction, quadratic_viscous_friction -> these have laws, with fewer numbers.
"""

import math
from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import AxisContext, Kind
from hil_sim.physics.lookup import POINTS_MAX, interpolated, relative_position
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.FRICTION_SPEED
NEEDS = "coulomb_friction"


class Params(NamedTuple):
    """A table of points evenly spaced over the logarithm of the speed."""

    first_m_s: Annotated[float, Quantity("m/s", 1e-9, 100.0, "speed v1 of the first point", "mm/s")]
    last_m_s: Annotated[float, Quantity("m/s", 1e-9, 100.0, "speed v2 of the last point", "mm/s")]
    points: Annotated[float, Quantity("", 2.0, POINTS_MAX, "number of points")]
    level_n: Annotated[
        tuple[float, ...], Quantity("N", -1e4, 1e4, "additional friction T at a point", length=POINTS_MAX)
    ]


NEUTRAL = Params(first_m_s=1e-3, last_m_s=1.0, points=2.0, level_n=(0.0,) * POINTS_MAX)


def problems(p: Params, _axis: AxisContext) -> Iterator[tuple[str, str]]:
    """Yield a problem unless the points rise."""
    if p.last_m_s <= p.first_m_s:
        yield "last_m_s", "must be above that of the first point"


@kernel
def level_n(p: Any, velocity_m_s: float) -> float:
    """Return the addition to the friction level (N) at a velocity (m/s)."""
    log_speed = math.log(max(abs(velocity_m_s), p.first_m_s))
    relative = relative_position(log_speed, math.log(p.first_m_s), math.log(p.last_m_s))
    return interpolated(p.level_n, p.points, relative)
