"""Table of force over position: a measured curve along the travel without a known law.

Law: F = T(x), T linear between points evenly spaced from x1 to x2, constant beyond them.
Source: a look-up table, as drives hold them for compensation.
Symbols: F force on the table N, positive towards positive positions; x table position m; x1 `first_m` m;
    x2 `last_m` m; T `force_n` N, its first `points` values.
Valid: along the travel where it was identified. It depends only on the position, so it adds no energy over a
    closed path.
Confused with: friction_table -> move back and forth over the same travel: a force has no direction.
"""

from collections.abc import Iterator
from itertools import pairwise
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import AxisContext, Kind
from hil_sim.physics.lookup import POINTS_MAX, interpolated, relative_position
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.TABLE_FORCE


class Params(NamedTuple):
    """A table of evenly spaced points."""

    first_m: Annotated[float, Quantity("m", -10.0, 10.0, "position x1 of the first point", "mm")]
    last_m: Annotated[float, Quantity("m", -10.0, 10.0, "position x2 of the last point", "mm")]
    points: Annotated[float, Quantity("", 2.0, POINTS_MAX, "number of points")]
    force_n: Annotated[
        tuple[float, ...], Quantity("N", -1e4, 1e4, "force T at each point", length=POINTS_MAX)
    ]


NEUTRAL = Params(first_m=-0.1, last_m=0.1, points=2.0, force_n=(0.0,) * POINTS_MAX)


def problems(p: Params, axis: AxisContext) -> Iterator[tuple[str, str]]:
    """Yield a problem unless the points rise and the substep resolves the steepest slope, a stiffness."""
    if p.last_m <= p.first_m:
        yield "last_m", "must be above that of the first point"
        return
    steepest_n = max(abs(b - a) for a, b in pairwise(p.force_n[: int(p.points)]))
    distance_m = (p.last_m - p.first_m) / (p.points - 1.0)
    if steepest_n / distance_m * axis.dt_s**2 > axis.moved_kg:
        yield "", "too steep for the table at this substep"


@kernel
def force_n(p: Any, position_m: float, _turn_rad_m: float) -> float:
    """Return the force on the table (N)."""
    return interpolated(p.force_n, p.points, relative_position(position_m, p.first_m, p.last_m))
