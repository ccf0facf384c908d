"""Position-dependent force: a spring, a cable chain, an incline that changes along the travel.

Law: F = c1 u + c2 u^2 + c3 u^3, u = (x - x0) / X limited to -1 to 1.
Source: mismatch catalogue, entry position_dependent_force (c0 + c1 x; c0 is constant_force).
Symbols: F force on the table N, positive towards positive positions; c1 c2 c3 `power_1_n` `power_2_n`
    `power_3_n` N; x table position m; x0 `centre_m` middle of the travel m; X `half_travel_m` half of it m.
Valid: along the travel where it was identified; constant beyond it. It depends only on the position, so it
    adds no energy over a closed path.
Confused with: position_dependent_friction -> move back and forth over the same travel: a force is equal in
    both directions, friction changes its sign.
"""

from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import AxisContext, Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.TABLE_FORCE


class Params(NamedTuple):
    """A cubic over the travel."""

    centre_m: Annotated[float, Quantity("m", -10.0, 10.0, "middle of the travel x0", "mm")]
    half_travel_m: Annotated[float, Quantity("m", 1e-6, 10.0, "half of the travel X", "mm")]
    power_1_n: Annotated[float, Quantity("N", -1e4, 1e4, "c1")] = 0.0
    power_2_n: Annotated[float, Quantity("N", -1e4, 1e4, "c2")] = 0.0
    power_3_n: Annotated[float, Quantity("N", -1e4, 1e4, "c3")] = 0.0


NEUTRAL = Params(centre_m=0.0, half_travel_m=0.1)


def problems(p: Params, axis: AxisContext) -> Iterator[tuple[str, str]]:
    """Yield a problem unless the substep resolves the largest slope, a stiffness bounded from above."""
    steepest_n = abs(p.power_1_n) + 2.0 * abs(p.power_2_n) + 3.0 * abs(p.power_3_n)
    if steepest_n / p.half_travel_m * axis.dt_s**2 > axis.moved_kg:
        yield "", "too steep for the table at this substep"


@kernel
def force_n(p: Any, position_m: float, _turn_rad_m: float) -> float:
    """Return the force on the table (N)."""
    u = min(1.0, max(-1.0, (position_m - p.centre_m) / p.half_travel_m))
    return float(u * (p.power_1_n + u * (p.power_2_n + u * p.power_3_n)))
