"""GMS presliding: springs in parallel, each slipping at its own share of the friction level.

Law: an element sticks, dF_i/dt = k_i v, until |F_i| reaches alpha_i s(v); it slips,
    dF_i/dt = sgn(v) C (alpha_i - |F_i| / s(v)), until the velocity reverses. F = sum F_i + c v sum of the
    sticking alpha_i.
Source: Al-Bender, Lampaert, Swevers (2005), equations (9) to (12), with micro-damping in the sticking
    elements; s(v) is the sum of the friction levels (Xia et al., equation 8). With s constant it is the
    model of Iwan (1966).
Symbols: F_i element force N; k_i `stiffness_n_m` N/m; alpha_i `share`, sum 1; C `attraction_n_s` N/s; s
    level N; c `micro_damping_n_s_m` N s/m; v m/s.
Valid: hysteresis with nonlocal memory (closed inner loops) and frictional lag.
    A slipping element never gains force faster than a sticking one, so that it always dissipates.
Catalogue: presliding_hysteresis.
Confused with: backlash (the loop is in force, not in position) -> compare encoder and scale; LuGre, whose
    inner loops drift -> small strokes on top of a large one.
"""

import math
from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import AxisContext, Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.PRESLIDING
NEEDS = "coulomb_friction"
ELEMENTS_MAX = 8
"""Bounds the number of elements, which is the length of the record; chosen."""
LIST_ENDS_AT = "share"
SHARE_TOLERANCE = 1e-6
"""Bounds the deviation of the sum of the shares from 1, which rounding in the file causes; chosen."""
LEVEL_MIN_N = 1e-9
"""A lower friction level counts as none, which prevents a division by zero; chosen."""


class Params(NamedTuple):
    """Up to eight elements; the list ends at the first share of zero."""

    share: Annotated[
        tuple[float, ...], Quantity("", 0.0, 1.0, "share alpha_i of the level", length=ELEMENTS_MAX)
    ]
    stiffness_n_m: Annotated[
        tuple[float, ...], Quantity("N/m", 0.0, 1e9, "stiffness k_i", "N/um", length=ELEMENTS_MAX)
    ]
    attraction_n_s: Annotated[
        float, Quantity("N/s", 0.0, 1e9, "rate C at which a slipping element follows s(v)")
    ]
    micro_damping_n_s_m: Annotated[float, Quantity("N s/m", 0.0, 1e6, "damping c of the sticking contact")]


class State(NamedTuple):
    """Force of each element (N), whether it slips (0, 1), and the direction of the last motion."""

    element_n: tuple[float, ...] = (0.0,) * ELEMENTS_MAX
    slipping: tuple[int, ...] = (0,) * ELEMENTS_MAX
    slip_direction: float = 0.0


NEUTRAL = None
"""No values remove the springs: without the section the contact is rigid (see coulomb_friction)."""


def problems(p: Params, _axis: AxisContext) -> Iterator[tuple[str, str]]:
    """Yield a problem unless the shares add up to 1."""
    total = math.fsum(p.share)
    if abs(total - 1.0) > SHARE_TOLERANCE:
        yield "", f"the shares add up to {total:g}, not 1"


def sticking_stiffness_n_m(p: Params) -> float:
    """Return the stiffness (N/m) while every element sticks."""
    return math.fsum(p.stiffness_n_m)


@kernel
def force_and_damping(p: Any, s: Any, _velocity_m_s: float, _level: float) -> tuple[float, float]:
    """Return the sum of the element forces (N), and the damping of sticking elements (N s/m)."""
    force = 0.0
    sticking = 0.0
    for i in range(ELEMENTS_MAX):
        if p.share[i] == 0.0:
            break
        force += s.element_n[i]
        if s.slipping[i] == 0:
            sticking += p.share[i]
    return force, float(p.micro_damping_n_s_m * sticking)


@kernel
def slide(p: Any, s: Any, velocity_m_s: float, level: float, dt_s: float) -> None:
    """Advance `s.element_n` (N) and `s.slipping` (0, 1) by `dt_s` at constant velocity and level."""
    if level < LEVEL_MIN_N:
        for i in range(ELEMENTS_MAX):
            s.element_n[i] = 0.0
        return
    if velocity_m_s == 0.0:
        return
    direction = 1.0 if velocity_m_s > 0.0 else -1.0
    reversed_motion = direction != s.slip_direction
    s.slip_direction = direction
    displacement_m = velocity_m_s * dt_s
    attraction_n = p.attraction_n_s * dt_s
    weight = attraction_n / (level + attraction_n)  # implicit Euler step of the slip law
    for i in range(ELEMENTS_MAX):
        if p.share[i] == 0.0:
            break
        slip_n = p.share[i] * level * direction
        sticking_n = s.element_n[i] + p.stiffness_n_m[i] * displacement_m
        if reversed_motion or s.slipping[i] == 0:
            slips = (sticking_n - slip_n) * direction > 0.0
            s.slipping[i] = 1 if slips else 0
            if slips:
                s.element_n[i] = _onset_n(s.element_n[i], sticking_n, slip_n, direction)
            else:
                s.element_n[i] = sticking_n
        else:
            slipping_n = s.element_n[i] + weight * (slip_n - s.element_n[i])
            s.element_n[i] = slipping_n if (sticking_n - slipping_n) * direction > 0.0 else sticking_n


@kernel
def _onset_n(before_n: float, sticking_n: float, slip_n: float, direction: float) -> float:
    """Return the force (N) of an element that begins to slip: the slip force.

    Where a fall of the level has left its force beyond the slip force, slip starts from that force.
    """
    if (before_n - slip_n) * direction > 0.0:
        return before_n
    return slip_n if (sticking_n - slip_n) * direction > 0.0 else sticking_n
