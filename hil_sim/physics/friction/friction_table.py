"""Table of friction over position: a measured curve along the travel without a known law.

Law: level += T(x), T linear between points evenly spaced from x1 to x2, constant beyond them; the sum of
    the levels is never below zero.
Source: a look-up table, as drives hold them for compensation; friction along the travel of a robot's joints,
    Armstrong-Helouvry (1991).
Symbols: T `level_n` N, its first `points` values; x position m; x1 `first_m` m; x2 `last_m` m.
Valid: along the travel where it was identified.
Confused with: force_table -> move back and forth over the same travel: friction changes its sign with the
    direction, a force does not.
"""

from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import AxisContext, Kind
from hil_sim.physics.lookup import POINTS_MAX, interpolated, relative_position
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.FRICTION_POSITION
NEEDS = "coulomb_friction"


class Params(NamedTuple):
    """A table of evenly spaced points."""

    first_m: Annotated[float, Quantity("m", -10.0, 10.0, "position x1 of the first point", "mm")]
    last_m: Annotated[float, Quantity("m", -10.0, 10.0, "position x2 of the last point", "mm")]
    points: Annotated[float, Quantity("", 2.0, POINTS_MAX, "number of points")]
    level_n: Annotated[
        tuple[float, ...], Quantity("N", -1e4, 1e4, "additional friction T at a point", length=POINTS_MAX)
    ]


NEUTRAL = Params(first_m=-0.1, last_m=0.1, points=2.0, level_n=(0.0,) * POINTS_MAX)


def problems(p: Params, _axis: AxisContext) -> Iterator[tuple[str, str]]:
    """Yield a problem unless the points rise."""
    if p.last_m <= p.first_m:
        yield "last_m", "must be above that of the first point"


@kernel
def level_n(p: Any, position_m: float) -> float:
    """Return the addition to the friction level (N) at a position (m)."""
    return interpolated(p.level_n, p.points, relative_position(position_m, p.first_m, p.last_m))
