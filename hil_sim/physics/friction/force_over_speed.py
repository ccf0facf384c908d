"""Table of friction over velocity: a measured curve without a known law, separate for each direction.

Law: level += s T(v), T linear between points evenly spaced from v1 to v2, constant beyond them; s the
    direction of motion. The sum of the levels is never below zero.
Source: a look-up table; friction is measured speed by speed (Armstrong-Helouvry 1991).
Symbols: T `force_n` N, additional motor force at a velocity, its first `points` values; v velocity m/s; v1
    `first_m_s` m/s, the fastest motion backwards; v2 `last_m_s` m/s.
Valid: at the speeds where it was identified. At rest it holds with the higher value of both directions.
Confused with: asymmetric_viscous_friction, quadratic_viscous_friction, stribeck_friction -> these have laws;
    friction_over_speed -> equal in both directions, with fine resolution at low speeds.
"""

from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import AxisContext, Kind
from hil_sim.physics.lookup import POINTS_MAX, interpolated, relative_position
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.FRICTION_SPEED
NEEDS = "coulomb_friction"


class Params(NamedTuple):
    """A table of evenly spaced points."""

    first_m_s: Annotated[float, Quantity("m/s", -100.0, 100.0, "velocity v1 of the first point", "mm/s")]
    last_m_s: Annotated[float, Quantity("m/s", -100.0, 100.0, "velocity v2 of the last point", "mm/s")]
    points: Annotated[float, Quantity("", 2.0, POINTS_MAX, "number of points")]
    force_n: Annotated[
        tuple[float, ...], Quantity("N", -1e4, 1e4, "force T that the motor needs", length=POINTS_MAX)
    ]


NEUTRAL = Params(first_m_s=-1.0, last_m_s=1.0, points=2.0, force_n=(0.0,) * POINTS_MAX)


def problems(p: Params, _axis: AxisContext) -> Iterator[tuple[str, str]]:
    """Yield a problem unless the points rise."""
    if p.last_m_s <= p.first_m_s:
        yield "last_m_s", "must be above that of the first point"


@kernel
def level_n(p: Any, velocity_m_s: float) -> float:
    """Return the addition to the friction level (N) at a velocity (m/s)."""
    force = interpolated(p.force_n, p.points, relative_position(velocity_m_s, p.first_m_s, p.last_m_s))
    if velocity_m_s == 0.0:
        return abs(force)
    return force if velocity_m_s > 0.0 else -force
