"""Step in time: force, friction, damping or mass changes once and permanently.

Law: F = dF h, level += dL h, damping += dB h, m += dm h; h = -1/2 before t0 and +1/2 from t0 on, so that the
    other sections hold the mean of the values before and after.
Source: an event without a law: a load is set down, a brake drags, a lubricator stops, a coupling slips.
Symbols: F force on the table N; dF `force_n` N; dL `level_n` N; dB `damping_n_s_m` N s/m; dm `mass_kg` kg; t
    time since power-up s; t0 `moment_s` s. The sums of levels, dampings and masses are never below zero.
Valid: one event, shorter than a sample. The velocity is continuous.
Confused with: lubrication_loss, which multiplies friction over a transition; temperature_dependent_friction
    -> a drift.
"""

from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import AxisContext, Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.CHANGE_IN_TIME


class Params(NamedTuple):
    """Time and size of the changes."""

    moment_s: Annotated[float, Quantity("s", 0.0, 1e7, "time since power-up t0")]
    force_n: Annotated[float, Quantity("N", -1e4, 1e4, "change dF of the force on the table")] = 0.0
    level_n: Annotated[float, Quantity("N", -1e4, 1e4, "change dL of the friction level")] = 0.0
    damping_n_s_m: Annotated[float, Quantity("N s/m", -1e5, 1e5, "change dB of the damping")] = 0.0
    mass_kg: Annotated[float, Quantity("kg", -1e5, 1e5, "change dm of the mass")] = 0.0


NEUTRAL = Params(moment_s=0.0)


def problems(p: Params, axis: AxisContext) -> Iterator[tuple[str, str]]:
    """Yield a problem unless the mass stays positive."""
    if 0.5 * abs(p.mass_kg) >= axis.moved_kg:
        yield "mass_kg", f"must be below twice the moving mass of {axis.moved_kg:g} kg"


@kernel
def _step(p: Any, time_s: float) -> float:
    """Return h: the step from -1/2 to +1/2 at t0."""
    return 0.5 if time_s >= p.moment_s else -0.5


@kernel
def force_n(p: Any, time_s: float) -> float:
    """Return the force on the table (N) at a time since power-up (s)."""
    return float(p.force_n * _step(p, time_s))


@kernel
def level_n(p: Any, time_s: float) -> float:
    """Return the addition to the friction level (N)."""
    return float(p.level_n * _step(p, time_s))


@kernel
def damping_n_s_m(p: Any, time_s: float) -> float:
    """Return the addition to the damping (N s/m)."""
    return float(p.damping_n_s_m * _step(p, time_s))


@kernel
def added_kg(p: Any, time_s: float) -> float:
    """Return the addition to the mass on the table (kg)."""
    return float(p.mass_kg * _step(p, time_s))
