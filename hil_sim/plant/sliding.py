"""Friction on the table: composes levels, damping and presliding into the velocity after a substep.

The levels add up, and a presliding law or the stick-or-slide rule converts their sum to a force. The friction
factors (heat, wear, lubrication) multiply the levels and the viscous damping, but not the stiffness and
damping of presliding, which belong to the contact's springs.
"""

import math
from typing import Any, NamedTuple

from hil_sim.physics.friction import coulomb_friction
from hil_sim.physics.kinds import Kind
from hil_sim.physics.registry import of_kind
from kernels.jit import kernel
from kernels.unrolled import unrolled

SPEED_MIN_M_S = 1e-15
"""A lower speed becomes 0: denormal numbers slow the kernel down tenfold (measured). Far below any count."""

LEVELS = of_kind(Kind.FRICTION_LEVEL, common=True)
DAMPINGS = of_kind(Kind.DAMPING, common=True)
LESS_COMMON_LEVELS = of_kind(Kind.FRICTION_LEVEL, common=False)
SPEED_LEVELS = of_kind(Kind.FRICTION_SPEED)
LOAD_LEVELS = of_kind(Kind.FRICTION_LOAD)
CHANGES_IN_TIME = of_kind(Kind.CHANGE_IN_TIME)
CHANGES_WITH_POSITION = of_kind(Kind.CHANGE_WITH_POSITION)
POSITION_LEVELS = of_kind(Kind.FRICTION_POSITION)
DWELL_LEVELS = of_kind(Kind.FRICTION_DWELL)
DIRECTION_LEVELS = of_kind(Kind.FRICTION_DIRECTION)
LESS_COMMON_DAMPINGS = of_kind(Kind.DAMPING, common=False)
CHANGES = of_kind(Kind.FRICTION_CHANGE)
CONTACTS = of_kind(Kind.PRESLIDING)
CONTACTS_WITH_LEVEL = of_kind(Kind.PRESLIDING_LEVEL)


class LessCommon(NamedTuple):
    """Contributions of the less common effects; `spring_n` is that of contacts with their own level."""

    level_n: float
    damping_n_s_m: float
    spring_n: float


@kernel
@unrolled
def friction_level_n(p: Any, s: Any, speed_m_s: float) -> float:
    """Return the sum of the common friction levels (N) at a sliding speed (m/s)."""
    level = 0.0
    for effect in LEVELS:
        if p[effect].enabled:
            level += effect.level_n(p[effect], s[effect], speed_m_s)
    return level


@kernel
@unrolled
def less_common_level_n(p: Any, s: Any, velocity_m_s: float) -> float:
    """Return the sum of the less common friction levels (N) at a velocity (m/s)."""
    level = 0.0
    direction = 0.0 if velocity_m_s == 0.0 else math.copysign(1.0, velocity_m_s)
    for effect in LESS_COMMON_LEVELS:
        if p[effect].enabled:
            level += effect.level_n(p[effect], s[effect], abs(velocity_m_s))
    for effect in POSITION_LEVELS:
        if p[effect].enabled:
            level += effect.level_n(p[effect], s[effect], s.table_position_m)
    for effect in DWELL_LEVELS:
        if p[effect].enabled:
            level += effect.level_n(p[effect], s[effect])
    for effect in DIRECTION_LEVELS:
        if p[effect].enabled:
            level += effect.level_n(p[effect], s[effect], direction)
    return level


@kernel
@unrolled
def changing_level_n(p: Any, s: Any, velocity_m_s: float) -> float:
    """Return the sum of the friction levels (N) by velocity, by load and by time, at a velocity (m/s)."""
    level = 0.0
    for effect in SPEED_LEVELS:
        if p[effect].enabled:
            level += effect.level_n(p[effect], s[effect], velocity_m_s)
    for effect in LOAD_LEVELS:
        if p[effect].enabled:
            level += effect.level_n(p[effect], s[effect], s.transmitted_n, s.friction_n)
    for effect in CHANGES_IN_TIME:
        if p[effect].enabled:
            level += effect.level_n(p[effect], s[effect], s.time_s)
    return level


@kernel
@unrolled
def less_common_friction(p: Any, s: Any, velocity_m_s: float, level_factor: float) -> LessCommon:
    """Return the sums of the less common levels, dampings and springs at a velocity (m/s)."""
    damping, spring = 0.0, 0.0
    for effect in LESS_COMMON_DAMPINGS:
        if p[effect].enabled:
            damping += effect.damping_n_s_m(p[effect], s[effect], velocity_m_s)
    for effect in CHANGES_IN_TIME:
        if p[effect].enabled:
            damping += effect.damping_n_s_m(p[effect], s[effect], s.time_s)
    for effect in CHANGES_WITH_POSITION:
        if p[effect].enabled:
            damping += effect.damping_n_s_m(p[effect], s[effect], s.table_position_m)
    for effect in CONTACTS_WITH_LEVEL:
        if p[effect].enabled:
            level_n = level_factor * p[effect].level_n
            force_n, _ = effect.force_and_damping(p[effect], s[effect], velocity_m_s, level_n)
            spring += force_n
    level_n = less_common_level_n(p, s, velocity_m_s) + changing_level_n(p, s, velocity_m_s)
    return LessCommon(level_n, damping, spring)


@kernel
@unrolled
def slide_less_common(p: Any, s: Any, velocity_m_s: float, level_factor: float, dt_s: float) -> None:
    """Advance the states of `less_common_friction` by `dt_s` (s) at constant velocity."""
    for effect in CONTACTS_WITH_LEVEL:
        if p[effect].enabled:
            level_n = level_factor * p[effect].level_n
            effect.slide(p[effect], s[effect], velocity_m_s, level_n, dt_s)
    for effect in DWELL_LEVELS:
        if p[effect].enabled:
            effect.slide(p[effect], s[effect], velocity_m_s, dt_s)


@kernel
@unrolled
def friction_factors(p: Any, s: Any) -> tuple[float, float]:
    """Return the products of the friction factors, on the levels and on the damping."""
    level, damping = 1.0, 1.0
    for effect in CHANGES:
        if p[effect].enabled:
            factors = effect.factors(p[effect], s[effect], s.time_s)
            level, damping = level * factors[0], damping * factors[1]
    return level, damping


@kernel
@unrolled
def slide(
    p: Any, s: Any, has_less_common: bool, mass_kg: float, velocity_m_s: float, force_n: float, dt_s: float
) -> float:
    """Advance friction by `dt_s` (s) under `force_n` (N); return the velocity (m/s) of the table afterwards.

    Writes the mean friction force of the substep (N) to `s.friction_n`. `has_less_common`: whether any effect
    of `less_common_friction` or `friction_factors` is present.
    """
    level_factor, damping_factor = friction_factors(p, s) if has_less_common else (1.0, 1.0)
    level_n = friction_level_n(p, s, abs(velocity_m_s))
    damping = 0.0
    for effect in DAMPINGS:
        if p[effect].enabled:
            damping += effect.damping_n_s_m(p[effect], s[effect], velocity_m_s)
    driving_n = force_n
    if has_less_common:
        others = less_common_friction(p, s, velocity_m_s, level_factor)
        level_n = max(0.0, level_n + others.level_n)
        damping = max(0.0, damping + others.damping_n_s_m)
        driving_n -= others.spring_n
    level_n = level_factor * level_n
    damping = damping_factor * damping
    after_m_s, rigid = 0.0, True
    for effect in CONTACTS:
        if p[effect].enabled:
            elastic_n, contact_damping = effect.force_and_damping(p[effect], s[effect], velocity_m_s, level_n)
            free_m_s = velocity_m_s + (driving_n - elastic_n) * dt_s / mass_kg
            after_m_s, rigid = free_m_s / (1.0 + (damping + contact_damping) * dt_s / mass_kg), False
            effect.slide(p[effect], s[effect], after_m_s, level_n, dt_s)
    if rigid:
        free_m_s = velocity_m_s + driving_n * dt_s / mass_kg
        sliding_m_s = coulomb_friction.stick_or_slide_m_s(free_m_s, level_n, mass_kg, dt_s)
        after_m_s = sliding_m_s / (1.0 + damping * dt_s / mass_kg)
    if has_less_common:
        slide_less_common(p, s, after_m_s, level_factor, dt_s)
    s.friction_n = force_n - mass_kg * (after_m_s - velocity_m_s) / dt_s
    return after_m_s if abs(after_m_s) > SPEED_MIN_M_S else 0.0
