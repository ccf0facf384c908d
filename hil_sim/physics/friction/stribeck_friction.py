"""Stribeck friction: friction above the kinetic level at low speed, before a lubricant film forms.

Law: level += (Fs - Fc) exp(-(v / vs)^2).
Source: Xia et al., equation (8), the term in Fs - Fc. If it is negative, down to -Fc, friction falls towards
    rest, as in the recordings of the EMPS axis (Janot, Gautier, Brunot 2019).
Symbols: Fs breakaway force N; Fc kinetic friction N; Fs - Fc `stribeck_n` N; vs `stribeck_m_s` m/s; v
    sliding speed m/s.
Valid: steady sliding; presliding_gms models the delay of the film with its attraction.
Confused with: presliding_hysteresis, also a bump at reversals -> slow constant speeds show only Stribeck
    friction; dwell_dependent_breakaway -> vary the dwell before the reversal.
"""

import math
from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import AxisContext, Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.FRICTION_LEVEL
NEEDS = "coulomb_friction"
COMMON = True
EXPONENT_MAX = 36.0
"""Beyond it the exponential is skipped: exp(-36) is below one part in 2^51 of the level."""


class Params(NamedTuple):
    """Height and width of the low-speed bump, or dip."""

    stribeck_n: Annotated[
        float, Quantity("N", -1e4, 1e4, "breakaway force above the kinetic friction, Fs - Fc")
    ]
    stribeck_m_s: Annotated[float, Quantity("m/s", 1e-6, 1.0, "Stribeck speed vs", "mm/s")]


NEUTRAL = Params(stribeck_n=0.0, stribeck_m_s=1e-2)


def problems(p: Params, axis: AxisContext) -> Iterator[tuple[str, str]]:
    """Yield a problem if friction at rest is below zero."""
    if NEEDS in axis.effects and axis.effects[NEEDS].coulomb_n + p.stribeck_n < 0.0:
        at_rest_n = axis.effects[NEEDS].coulomb_n + p.stribeck_n
        yield "stribeck_n", f"friction at rest would be {at_rest_n:g} N, below 0"


@kernel
def level_n(p: Any, speed_m_s: float) -> float:
    """Return the friction level above the kinetic one (N) at a sliding speed |v| (m/s)."""
    ratio = speed_m_s / p.stribeck_m_s
    exponent = ratio * ratio
    return float(p.stribeck_n * math.exp(-exponent)) if exponent < EXPONENT_MAX else 0.0
