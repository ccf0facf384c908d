"""Map of force over position and velocity: a measured surface without a known law.

Law: F = T(x, v), T bilinear between points evenly spaced from x1 to x2 and from v1 to v2, constant beyond
    them.
Source: a look-up table over two coordinates, as maps of engines and of friction along the travel are held.
Symbols: F force on the table N, positive towards positive positions; x table position m; v table velocity
    m/s; x1 `first_m` m; x2 `last_m` m; v1 `first_m_s` m/s; v2 `last_m_s` m/s; T `force_n` N, its first
    `positions` values at v1, from x1 to x2, then those at each of the `velocities` up to v2.
Valid: where position and velocity were both in the motion that identified it. It may drive the axis: a force
    that grows with the velocity gives energy, bounded because T is constant beyond its points.
Confused with: force_table, force_over_speed, change_along_travel -> these are functions of one coordinate, or
    that function times the velocity; pass the same place at several speeds.
"""

from collections.abc import Iterator
from itertools import pairwise
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import AxisContext, Kind
from hil_sim.physics.lookup import bilinear, relative_position
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.STATE_FORCE
POSITIONS_MAX, VELOCITIES_MAX = 17, 9
"""Bound the points along each coordinate, and so the length of the record; chosen."""
LENGTH = POSITIONS_MAX * VELOCITIES_MAX


class Params(NamedTuple):
    """A grid of evenly spaced points."""

    first_m: Annotated[float, Quantity("m", -10.0, 10.0, "position x1 of the first points", "mm")]
    last_m: Annotated[float, Quantity("m", -10.0, 10.0, "position x2 of the last points", "mm")]
    positions: Annotated[float, Quantity("", 2.0, POSITIONS_MAX, "number of points along the position")]
    first_m_s: Annotated[float, Quantity("m/s", -100.0, 100.0, "velocity v1 of the first points", "mm/s")]
    last_m_s: Annotated[float, Quantity("m/s", -100.0, 100.0, "velocity v2 of the last points", "mm/s")]
    velocities: Annotated[float, Quantity("", 2.0, VELOCITIES_MAX, "number of points along the velocity")]
    force_n: Annotated[
        tuple[float, ...], Quantity("N", -1e4, 1e4, "force T, all positions at v1 first", length=LENGTH)
    ]


NEUTRAL = Params(
    first_m=-0.1,
    last_m=0.1,
    positions=2.0,
    first_m_s=-1.0,
    last_m_s=1.0,
    velocities=2.0,
    force_n=(0.0,) * LENGTH,
)


def problems(p: Params, axis: AxisContext) -> Iterator[tuple[str, str]]:
    """Yield a problem unless points rise and the substep resolves the steepest stiffness and damping."""
    if p.last_m <= p.first_m:
        yield "last_m", "must be above that of the first point"
        return
    if p.last_m_s <= p.first_m_s:
        yield "last_m_s", "must be above that of the first point"
        return
    positions, velocities = int(p.positions), int(p.velocities)
    rows = [p.force_n[k * positions : (k + 1) * positions] for k in range(velocities)]
    columns = zip(*rows, strict=True)
    along_n = max(abs(b - a) for row in rows for a, b in pairwise(row))
    across_n = max(abs(b - a) for column in columns for a, b in pairwise(column))
    stiffness_n_m = along_n * (positions - 1) / (p.last_m - p.first_m)
    damping_n_s_m = across_n * (velocities - 1) / (p.last_m_s - p.first_m_s)
    if stiffness_n_m * axis.dt_s**2 > axis.moved_kg or damping_n_s_m * axis.dt_s > axis.moved_kg:
        yield "", "too steep for the table at this substep"


@kernel
def force_n(p: Any, position_m: float, velocity_m_s: float) -> float:
    """Return the force on the table (N) at a position (m) and a velocity (m/s)."""
    along = relative_position(position_m, p.first_m, p.last_m)
    across = relative_position(velocity_m_s, p.first_m_s, p.last_m_s)
    return bilinear(p.force_n, p.positions, p.velocities, along, across)
