"""Friction on the table: levels, damping and presliding, composed into the velocity after a substep.

The levels add up, and either a presliding law or the stick-or-slide rule turns their sum into a force. What
changes friction with use multiplies the levels and the viscous damping; stiffness and damping of presliding
belong to the contact's springs and stay. Adding an effect touches its own file, one line in a sum below, and
one in `presence`.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from hil_sim.physics.friction import (
    asymmetric_coulomb_friction,
    asymmetric_viscous_friction,
    coulomb_friction,
    dwell_dependent_breakaway,
    friction_ageing,
    lubrication_loss,
    position_dependent_friction,
    presliding_gms,
    presliding_hysteresis,
    presliding_lugre,
    quadratic_viscous_friction,
    stribeck_friction,
    temperature_dependent_friction,
    viscous_friction,
)
from hil_sim.physics.jit import kernel

NEGLIGIBLE_M_S = 1e-15  # slower is standing: denormal numbers would slow the kernel down tenfold


class More(NamedTuple):
    """What the less common effects add to the sums; the spring is that of presliding_hysteresis."""

    level_n: float
    damping_n_s_m: float
    spring_n: float


@kernel
def friction_level_n(p: Any, speed_m_s: float) -> float:
    """Sum of the friction levels (N) at a sliding speed (m/s), without those of `more_friction`."""
    level = 0.0
    if p.coulomb_friction.enabled:
        level += coulomb_friction.level_n(p.coulomb_friction, speed_m_s)
    if p.stribeck_friction.enabled:
        level += stribeck_friction.level_n(p.stribeck_friction, speed_m_s)
    return level


@kernel
def more_friction(p: Any, s: Any, velocity_m_s: float, level_factor: float) -> More:
    """Sums of the less common levels and dampings at a velocity (m/s)."""
    level, damping, spring = 0.0, 0.0, 0.0
    direction = 0.0 if velocity_m_s == 0.0 else math.copysign(1.0, velocity_m_s)
    if p.position_dependent_friction.enabled:
        level += position_dependent_friction.level_n(p.position_dependent_friction, s.table_position_m)
    if p.dwell_dependent_breakaway.enabled:
        level += dwell_dependent_breakaway.level_n(p.dwell_dependent_breakaway, s)
    if p.asymmetric_coulomb_friction.enabled:
        level += asymmetric_coulomb_friction.level_n(p.asymmetric_coulomb_friction, direction)
    if p.asymmetric_viscous_friction.enabled:
        damping += asymmetric_viscous_friction.damping_n_s_m(p.asymmetric_viscous_friction, velocity_m_s)
    if p.quadratic_viscous_friction.enabled:
        damping += quadratic_viscous_friction.damping_n_s_m(p.quadratic_viscous_friction, velocity_m_s)
    if p.presliding_hysteresis.enabled:
        level_n = level_factor * p.presliding_hysteresis.level_n
        spring, _ = presliding_hysteresis.force_and_damping(p.presliding_hysteresis, s, velocity_m_s, level_n)
    return More(level, damping, spring)


@kernel
def move_more(p: Any, s: Any, velocity_m_s: float, level_factor: float, dt_s: float) -> None:
    """Advance the states of `more_friction` by `dt_s` (s) at constant velocity."""
    if p.presliding_hysteresis.enabled:
        level_n = level_factor * p.presliding_hysteresis.level_n
        presliding_hysteresis.slide(p.presliding_hysteresis, s, velocity_m_s, level_n, dt_s)
    if p.dwell_dependent_breakaway.enabled:
        dwell_dependent_breakaway.slide(p.dwell_dependent_breakaway, s, velocity_m_s, dt_s)


@kernel
def friction_factors(p: Any, s: Any) -> tuple[float, float]:
    """Products of the factors by which friction has changed: on the levels, on the damping."""
    time_s, travelled_m, warmth_k = s.time_s, s.travelled_m, s.lubricant_warmth_k
    level, damping = 1.0, 1.0
    if p.temperature_dependent_friction.enabled:
        warm = temperature_dependent_friction.factors(
            p.temperature_dependent_friction, time_s, travelled_m, warmth_k
        )
        level, damping = level * warm[0], damping * warm[1]
    if p.lubrication_loss.enabled:
        dry = lubrication_loss.factors(p.lubrication_loss, time_s, travelled_m, warmth_k)
        level, damping = level * dry[0], damping * dry[1]
    if p.friction_ageing.enabled:
        worn = friction_ageing.factors(p.friction_ageing, time_s, travelled_m, warmth_k)
        level, damping = level * worn[0], damping * worn[1]
    return level, damping


@kernel
def slide(
    p: Any, s: Any, has_more: bool, mass_kg: float, velocity_m_s: float, force_n: float, dt_s: float
) -> float:
    """Velocity (m/s) of the table after `dt_s` under `force_n` (N) and friction, whose states advance.

    `has_more`: there are effects of `more_friction`.
    """
    level_factor, damping_factor = friction_factors(p, s)
    level_n = friction_level_n(p, abs(velocity_m_s))
    damping = 0.0
    if p.viscous_friction.enabled:
        damping += viscous_friction.damping_n_s_m(p.viscous_friction, velocity_m_s)
    pushing_n = force_n
    if has_more:
        more = more_friction(p, s, velocity_m_s, level_factor)
        level_n = max(0.0, level_n + more.level_n)
        damping = max(0.0, damping + more.damping_n_s_m)
        pushing_n -= more.spring_n
    level_n = level_factor * level_n
    damping = damping_factor * damping
    if p.presliding_lugre.enabled:
        bristle_n, extra = presliding_lugre.force_and_damping(p.presliding_lugre, s, velocity_m_s, level_n)
        free_m_s = velocity_m_s + (pushing_n - bristle_n) * dt_s / mass_kg
        after_m_s = free_m_s / (1.0 + (damping + extra) * dt_s / mass_kg)
        presliding_lugre.slide(p.presliding_lugre, s, after_m_s, level_n, dt_s)
    elif p.presliding_gms.enabled:
        elements_n, extra = presliding_gms.force_and_damping(p.presliding_gms, s, velocity_m_s, level_n)
        free_m_s = velocity_m_s + (pushing_n - elements_n) * dt_s / mass_kg
        after_m_s = free_m_s / (1.0 + (damping + extra) * dt_s / mass_kg)
        presliding_gms.slide(p.presliding_gms, s, after_m_s, level_n, dt_s)
    else:
        free_m_s = velocity_m_s + pushing_n * dt_s / mass_kg
        sliding_m_s = coulomb_friction.stick_or_slide_m_s(free_m_s, level_n, mass_kg, dt_s)
        after_m_s = sliding_m_s / (1.0 + damping * dt_s / mass_kg)
    if has_more:
        move_more(p, s, after_m_s, level_factor, dt_s)
    s.friction_n = force_n - mass_kg * (after_m_s - velocity_m_s) / dt_s
    return after_m_s if abs(after_m_s) > NEGLIGIBLE_M_S else 0.0
