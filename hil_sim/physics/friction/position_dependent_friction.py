"""Position-dependent friction: preload, wear and misalignment make friction differ along the travel.

Law: level += c1 u + c2 u^2 + c3 u^3 + A sin(2 pi x / L + p), u = (x - x0) / X limited to -1 to 1; the sum of
    the levels is never below zero.
Source: mismatch catalogue, entry position_dependent_friction (s Fc(x), 5-50 %); measured along the travel of
    robot joints by Armstrong-Helouvry (1991).
Symbols: c1 c2 c3 `power_1_n` `power_2_n` `power_3_n` N; x position m; x0 `centre_m` middle of the travel m;
    X `half_travel_m` half of it m; A `wave_n` N, L `wave_length_m` m, p `wave_phase_rad` rad: a ripple of
    friction, as from the pitch of the balls.
Valid: along the travel where it was identified; constant beyond it.
Confused with: position_dependent_force -> move back and forth over the same travel: friction changes its
    sign with the direction, a force does not.
"""

import math
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.FRICTION_POSITION
NEEDS = "coulomb_friction"


class Params(NamedTuple):
    """A cubic over the travel, and a ripple."""

    centre_m: Annotated[float, Quantity("m", -10.0, 10.0, "middle of the travel x0", "mm")]
    half_travel_m: Annotated[float, Quantity("m", 1e-6, 10.0, "half of the travel X", "mm")]
    power_1_n: Annotated[float, Quantity("N", -1e4, 1e4, "c1")] = 0.0
    power_2_n: Annotated[float, Quantity("N", -1e4, 1e4, "c2")] = 0.0
    power_3_n: Annotated[float, Quantity("N", -1e4, 1e4, "c3")] = 0.0
    wave_n: Annotated[float, Quantity("N", -1e4, 1e4, "amplitude A of the ripple")] = 0.0
    wave_length_m: Annotated[float, Quantity("m", 1e-6, 10.0, "length L of the ripple", "mm")] = 1e-2
    wave_phase_rad: Annotated[float, Quantity("rad", -7.0, 7.0, "phase p of the ripple", "deg")] = 0.0


NEUTRAL = Params(centre_m=0.0, half_travel_m=0.1)


@kernel
def level_n(p: Any, position_m: float) -> float:
    """Return the addition to the friction level (N) at a position (m)."""
    u = min(1.0, max(-1.0, (position_m - p.centre_m) / p.half_travel_m))
    ripple = p.wave_n * math.sin(2.0 * math.pi * position_m / p.wave_length_m + p.wave_phase_rad)
    return float(u * (p.power_1_n + u * (p.power_2_n + u * p.power_3_n)) + ripple)
