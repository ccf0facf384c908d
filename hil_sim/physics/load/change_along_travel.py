"""Change along the travel: measured damping and mass over position, without a known law.

Law: b += B(x), m += M(x), each linear between points evenly spaced from x1 to x2, constant beyond them.
Source: a look-up table; inertia and damping over the configuration of a mechanism, Armstrong-Helouvry (1991).
Symbols: B `damping_n_s_m` N s/m; M `mass_kg` kg, the first `points` values of each; x table position m;
    x1 `first_m` m; x2 `last_m` m. The sums of damping and mass are never below zero.
Valid: along the travel where it was identified. It excludes the force M'(x) v^2 / 2 of a mechanism with
    changing inertia.
Confused with: friction_table -> does not grow with the speed; force_table -> also acts at rest.
"""

from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import AxisContext, Kind
from hil_sim.physics.lookup import POINTS_MAX, interpolated, relative_position
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.CHANGE_WITH_POSITION


class Params(NamedTuple):
    """A table of evenly spaced points."""

    first_m: Annotated[float, Quantity("m", -10.0, 10.0, "position x1 of the first point", "mm")]
    last_m: Annotated[float, Quantity("m", -10.0, 10.0, "position x2 of the last point", "mm")]
    points: Annotated[float, Quantity("", 2.0, POINTS_MAX, "number of points")]
    damping_n_s_m: Annotated[
        tuple[float, ...], Quantity("N s/m", -1e5, 1e5, "additional damping B at a point", length=POINTS_MAX)
    ] = (0.0,) * POINTS_MAX
    mass_kg: Annotated[
        tuple[float, ...], Quantity("kg", -1e5, 1e5, "additional mass M at a point", length=POINTS_MAX)
    ] = (0.0,) * POINTS_MAX


NEUTRAL = Params(first_m=-0.1, last_m=0.1, points=2.0)


def problems(p: Params, axis: AxisContext) -> Iterator[tuple[str, str]]:
    """Yield a problem unless the points rise and the mass stays positive."""
    if p.last_m <= p.first_m:
        yield "last_m", "must be above that of the first point"
    if min(p.mass_kg) <= -axis.moved_kg:
        yield "mass_kg", f"would remove the whole moving mass of {axis.moved_kg:g} kg"


@kernel
def damping_n_s_m(p: Any, position_m: float) -> float:
    """Return the addition to the damping (N s/m) at a position (m)."""
    return interpolated(p.damping_n_s_m, p.points, relative_position(position_m, p.first_m, p.last_m))


@kernel
def added_kg(p: Any, position_m: float) -> float:
    """Return the addition to the mass on the table (kg)."""
    return interpolated(p.mass_kg, p.points, relative_position(position_m, p.first_m, p.last_m))
