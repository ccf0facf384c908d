"""Drift over time: measured force, friction, damping and mass over the run, without a known law.

Law: F = T(t), level += L(t), b += B(t), m += M(t), each linear between points that are evenly spaced from
    t1 to t2, constant beyond them.
Source: a look-up table, the only model of a slow disturbance known only from a recording.
Symbols: F force on the table N; T `force_n` N; L `level_n` N; B `damping_n_s_m` N s/m;
    M `mass_kg` kg, the first `points` values of each; t time since power-up s; t1 `first_s` s; t2 `last_s` s.
    The sums of levels, dampings and masses are never below zero.
Valid: in the run where it was identified; another run has another drift.
Confused with: temperature_dependent_friction -> returns with cooling; step_in_time -> changes once.
"""

from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import AxisContext, Kind
from hil_sim.physics.lookup import POINTS_MAX, interpolated, relative_position
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.CHANGE_IN_TIME


class Params(NamedTuple):
    """A table of evenly spaced points."""

    first_s: Annotated[float, Quantity("s", 0.0, 1e7, "time since power-up t1 of the first point")]
    last_s: Annotated[float, Quantity("s", 0.0, 1e7, "time since power-up t2 of the last point")]
    points: Annotated[float, Quantity("", 2.0, POINTS_MAX, "number of points")]
    force_n: Annotated[
        tuple[float, ...], Quantity("N", -1e4, 1e4, "force T on the table at each point", length=POINTS_MAX)
    ] = (0.0,) * POINTS_MAX
    level_n: Annotated[
        tuple[float, ...], Quantity("N", -1e4, 1e4, "additional friction L at a point", length=POINTS_MAX)
    ] = (0.0,) * POINTS_MAX
    damping_n_s_m: Annotated[
        tuple[float, ...], Quantity("N s/m", -1e5, 1e5, "additional damping B at a point", length=POINTS_MAX)
    ] = (0.0,) * POINTS_MAX
    mass_kg: Annotated[
        tuple[float, ...], Quantity("kg", -1e5, 1e5, "additional mass M at a point", length=POINTS_MAX)
    ] = (0.0,) * POINTS_MAX


NEUTRAL = Params(first_s=0.0, last_s=1.0, points=2.0)


def problems(p: Params, axis: AxisContext) -> Iterator[tuple[str, str]]:
    """Yield a problem unless the points rise and the mass stays positive."""
    if p.last_s <= p.first_s:
        yield "last_s", "must be above that of the first point"
    if min(p.mass_kg) <= -axis.moved_kg:
        yield "mass_kg", f"would remove the whole moving mass of {axis.moved_kg:g} kg"


@kernel
def force_n(p: Any, time_s: float) -> float:
    """Return the force on the table (N) at a time since power-up (s)."""
    return interpolated(p.force_n, p.points, relative_position(time_s, p.first_s, p.last_s))


@kernel
def level_n(p: Any, time_s: float) -> float:
    """Return the addition to the friction level (N)."""
    return interpolated(p.level_n, p.points, relative_position(time_s, p.first_s, p.last_s))


@kernel
def damping_n_s_m(p: Any, time_s: float) -> float:
    """Return the addition to the damping (N s/m)."""
    return interpolated(p.damping_n_s_m, p.points, relative_position(time_s, p.first_s, p.last_s))


@kernel
def added_kg(p: Any, time_s: float) -> float:
    """Return the addition to the mass on the table (kg)."""
    return interpolated(p.mass_kg, p.points, relative_position(time_s, p.first_s, p.last_s))
