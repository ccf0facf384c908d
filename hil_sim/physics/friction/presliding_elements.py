"""Presliding elements: parallel elements, each with its own distance, that form any presliding curve.

Law: dz_i/dx = (1 - z_i s)^n_i / d_i,  F = L sum a_i z_i; s the direction of motion. n = 1 is Dahl's
    exponential; n = 0 is Jenkins' element, a spring that slips abruptly (several are Maxwell slip); n = 2
    approaches slip slowly. For constant v each step is exact: (1 - z s)^(1 - n) is linear in the distance.
Source: Dahl (1968) with its exponent; Iwan (1966), springs that slip in parallel, the elements of GMS
    (Al-Bender, Lampaert, Swevers 2005) without frictional lag.
Symbols: F friction force N, in addition to the other levels; L `level_n` N; a_i `share`, sum 1; w_i `way_m`
    m, distance from rest for 63 % of an element; d_i = w_i (1 - n) / (1 - exp(n - 1)), w_i for
    n = 1; n_i `exponent`; z_i `deflection`, -1 to 1; x position m; v velocity m/s.
Valid: up to eight elements. Inner loops close with n = 0; otherwise they drift, as in
    presliding_hysteresis.
Confused with: backlash (the loop is in force, not in position) -> compare encoder and scale; presliding_gms,
    which shapes all other levels and follows them with a lag.
"""

import math
from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import AxisContext, Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.PRESLIDING_LEVEL
ELEMENTS_MAX = 8
"""Bounds the number of elements, which is the length of the record; chosen."""
LIST_ENDS_AT = "share"
SHARE_TOLERANCE = 1e-6
"""Bounds the deviation of the sum of the shares from 1, which rounding in the file causes; chosen."""
LEVEL_MIN_N = 1e-9
"""A lower friction level counts as none, which prevents a division by zero; chosen."""
EXPONENT_TOLERANCE = 1e-9
"""An exponent closer to 1 counts as 1, where the power law has its exponential limit; chosen."""
DISTANCE_MIN_M = 1e-12
"""Bounds the distance of an element from below: prevents a division by zero; chosen."""


class Params(NamedTuple):
    """Level, and the elements that share it; the list ends at the first share of zero."""

    level_n: Annotated[float, Quantity("N", 0.0, 1e4, "friction level L of all elements")]
    share: Annotated[tuple[float, ...], Quantity("", 0.0, 1.0, "share a_i of the level", length=ELEMENTS_MAX)]
    way_m: Annotated[
        tuple[float, ...],
        Quantity("m", 0.0, 1e-2, "distance w_i to 63 % of its friction", "um", length=ELEMENTS_MAX),
    ]
    exponent: Annotated[
        tuple[float, ...], Quantity("", 0.0, 2.0, "exponent n_i of its curve", length=ELEMENTS_MAX)
    ]


class State(NamedTuple):
    """Deflection of each element relative to its deflection at slip, -1 to 1."""

    deflection: tuple[float, ...] = (0.0,) * ELEMENTS_MAX


NEUTRAL = Params(
    level_n=0.0,
    share=(1.0,) + (0.0,) * (ELEMENTS_MAX - 1),
    way_m=(1e-5,) * ELEMENTS_MAX,
    exponent=(1.0,) * ELEMENTS_MAX,
)


def problems(p: Params, _axis: AxisContext) -> Iterator[tuple[str, str]]:
    """Yield a problem unless the shares add up to 1 and each element has a distance."""
    total = math.fsum(p.share)
    if abs(total - 1.0) > SHARE_TOLERANCE:
        yield "", f"the shares add up to {total:g}, not 1"
    if any(share > 0.0 and distance_m <= 0.0 for share, distance_m in zip(p.share, p.way_m, strict=True)):
        yield "way_m", "must be above 0: an element without a distance is coulomb_friction"


def sticking_stiffness_n_m(p: Params) -> float:
    """Return the largest stiffness (N/m): after a reversal the curve is steepest."""
    elements = zip(p.share, p.way_m, p.exponent, strict=True)
    return math.fsum(
        2.0**n * share * p.level_n / element_distance_m(distance_63_m, n)
        for share, distance_63_m, n in elements
        if share * distance_63_m > 0.0
    )


@kernel
def element_distance_m(distance_63_m: float, exponent: float) -> float:
    """Return the distance d (m) in the law of an element from its distance to 63 % (m)."""
    power = 1.0 - exponent
    if abs(power) < EXPONENT_TOLERANCE:
        return distance_63_m
    return distance_63_m * power / -math.expm1(-power)


@kernel
def deflection_after(deflection: float, step_m: float, distance_m: float, exponent: float) -> float:
    """Return the deflection, -1 to 1, of an element with this distance d (m) after a displacement (m)."""
    if step_m == 0.0:
        return deflection
    direction = 1.0 if step_m > 0.0 else -1.0
    remaining = 1.0 - deflection * direction
    power = 1.0 - exponent
    if abs(power) < EXPONENT_TOLERANCE:
        remaining *= math.exp(-abs(step_m) / distance_m)
    elif remaining > 0.0:
        root = remaining**power - power * abs(step_m) / distance_m
        remaining = root ** (1.0 / power) if root > 0.0 else 0.0
    return direction * (1.0 - remaining)


@kernel
def force_and_damping(p: Any, s: Any, _velocity_m_s: float, level: float) -> tuple[float, float]:
    """Return the force (N) of the elements, and no damping; `level` (N) is L with its changes in use."""
    if level < LEVEL_MIN_N:
        return 0.0, 0.0
    force = 0.0
    for i in range(ELEMENTS_MAX):
        if p.share[i] == 0.0:
            break
        force += p.share[i] * s.deflection[i]
    return level * force, 0.0


@kernel
def slide(p: Any, s: Any, velocity_m_s: float, level: float, dt_s: float) -> None:
    """Move the elements for `dt_s` at constant velocity; an element keeps its spring stiffness."""
    for i in range(ELEMENTS_MAX):
        if p.share[i] == 0.0:
            break
        if level < LEVEL_MIN_N or p.level_n < LEVEL_MIN_N:
            s.deflection[i] = 0.0
            continue
        distance_m = max(element_distance_m(p.way_m[i], p.exponent[i]) * level / p.level_n, DISTANCE_MIN_M)
        s.deflection[i] = deflection_after(s.deflection[i], velocity_m_s * dt_s, distance_m, p.exponent[i])
