"""One axis, one substep: the effects composed in a fixed order.

Semi-implicit Euler: forces from the positions of step n, velocities with damping taken implicitly, positions
with the new velocities. Adding an effect touches its own file and one line in a sum below.

Friction acts on the table (Xia et al., equation 5); its levels add up, and either a presliding law or the
stick-or-slide rule turns their sum into a force. What changes friction with use multiplies the levels and the
viscous damping; stiffness and damping of presliding belong to the contact's springs and stay.

Lead errors and growth shift the table against the screw: the coupling acts on the shifted distance, and by
virtual work on the motor with the same ratio.
"""

from __future__ import annotations

import math
from typing import Any

from hil_sim.physics.friction import (
    coulomb_friction,
    friction_ageing,
    friction_warm_up,
    lubrication_loss,
    presliding_gms,
    presliding_lugre,
    stribeck_friction,
    viscous_friction,
)
from hil_sim.physics.jit import kernel
from hil_sim.physics.load import constant_force, structural_mode
from hil_sim.physics.motor import cogging
from hil_sim.physics.transmission import (
    backlash,
    drive_compliance,
    lead_error_cumulative,
    lead_error_periodic,
    thermal_expansion,
)

NEGLIGIBLE_M_S = 1e-15  # slower is standing: denormal numbers would slow the kernel down tenfold


@kernel
def friction_level_n(p: Any, speed_m_s: float) -> float:
    """Sum of the friction levels (N) at a sliding speed (m/s)."""
    level = 0.0
    if p.coulomb_friction.enabled:
        level += coulomb_friction.level_n(p.coulomb_friction, speed_m_s)
    if p.stribeck_friction.enabled:
        level += stribeck_friction.level_n(p.stribeck_friction, speed_m_s)
    return level


@kernel
def damping_n_s_m(p: Any) -> float:
    """Sum of the damping coefficients on the table (N s/m)."""
    damping = 0.0
    if p.viscous_friction.enabled:
        damping += viscous_friction.damping_n_s_m(p.viscous_friction)
    return damping


@kernel
def friction_factors(p: Any, s: Any) -> tuple[float, float]:
    """Products of the factors by which friction has changed: on the levels, on the damping."""
    time_s, travelled_m, warmth_k = s.time_s, s.travelled_m, s.lubricant_warmth_k
    level, damping = 1.0, 1.0
    if p.friction_warm_up.enabled:
        warm = friction_warm_up.factors(p.friction_warm_up, time_s, travelled_m, warmth_k)
        level, damping = level * warm[0], damping * warm[1]
    if p.lubrication_loss.enabled:
        dry = lubrication_loss.factors(p.lubrication_loss, time_s, travelled_m, warmth_k)
        level, damping = level * dry[0], damping * dry[1]
    if p.friction_ageing.enabled:
        worn = friction_ageing.factors(p.friction_ageing, time_s, travelled_m, warmth_k)
        level, damping = level * worn[0], damping * worn[1]
    return level, damping


@kernel
def motor_force_n(p: Any, s: Any, turn_rad_m: float) -> float:
    """Sum of the forces on the motor side (N)."""
    force = p.mechanics.force_constant_n_a * s.current_a
    if p.cogging.enabled:
        force += cogging.force_n(p.cogging, s.motor_position_m, turn_rad_m)
    return float(force)


@kernel
def load_force_n(p: Any, s: Any, turn_rad_m: float) -> float:
    """Sum of the forces from outside on the table (N)."""
    force = 0.0
    if p.constant_force.enabled:
        force += constant_force.force_n(p.constant_force, s.table_position_m, turn_rad_m)
    return force


@kernel
def swing(p: Any, s: Any, dt_s: float) -> float:
    """Force (N) of the carried mass on the table; the mass' velocity advances by `dt_s` (s)."""
    deflection_m = s.carried_position_m - s.table_position_m
    rate_m_s = s.carried_velocity_m_s - s.table_velocity_m_s
    force = structural_mode.force_n(p.structural_mode, deflection_m, rate_m_s)
    velocity_m_s = s.carried_velocity_m_s - force * dt_s / p.structural_mode.mass_kg
    s.carried_velocity_m_s = velocity_m_s if abs(velocity_m_s) > NEGLIGIBLE_M_S else 0.0
    return force


@kernel
def nominal_error(p: Any, position_m: float, turn_rad_m: float, temperature_k: float) -> tuple[float, float]:
    """Sum of the screw's position errors (m) at a motor position, and its derivative by the position."""
    error_m = 0.0
    slope = 0.0
    if p.lead_error_cumulative.enabled:
        e = p.lead_error_cumulative
        error_m += lead_error_cumulative.error_m(e, position_m, turn_rad_m, temperature_k)
        slope += lead_error_cumulative.slope(e, position_m, turn_rad_m, temperature_k)
    if p.lead_error_periodic.enabled:
        e_turn = p.lead_error_periodic
        error_m += lead_error_periodic.error_m(e_turn, position_m, turn_rad_m, temperature_k)
        slope += lead_error_periodic.slope(e_turn, position_m, turn_rad_m, temperature_k)
    if p.thermal_expansion.enabled:
        e_warm = p.thermal_expansion
        error_m += thermal_expansion.error_m(e_warm, position_m, turn_rad_m, temperature_k)
        slope += thermal_expansion.slope(e_warm, position_m, turn_rad_m, temperature_k)
    return error_m, slope


@kernel
def slide(p: Any, s: Any, mass_kg: float, velocity_m_s: float, force_n: float, dt_s: float) -> float:
    """Velocity (m/s) of the table after `dt_s` under `force_n` (N) and friction, whose states advance."""
    level_factor, damping_factor = friction_factors(p, s)
    level_n = level_factor * friction_level_n(p, abs(velocity_m_s))
    damping = damping_factor * damping_n_s_m(p)
    if p.presliding_lugre.enabled:
        bristle_n, extra = presliding_lugre.force_and_damping(p.presliding_lugre, s, velocity_m_s, level_n)
        free_m_s = velocity_m_s + (force_n - bristle_n) * dt_s / mass_kg
        after_m_s = free_m_s / (1.0 + (damping + extra) * dt_s / mass_kg)
        presliding_lugre.slide(p.presliding_lugre, s, after_m_s, level_n, dt_s)
    elif p.presliding_gms.enabled:
        elements_n, extra = presliding_gms.force_and_damping(p.presliding_gms, s, velocity_m_s, level_n)
        free_m_s = velocity_m_s + (force_n - elements_n) * dt_s / mass_kg
        after_m_s = free_m_s / (1.0 + (damping + extra) * dt_s / mass_kg)
        presliding_gms.slide(p.presliding_gms, s, after_m_s, level_n, dt_s)
    else:
        free_m_s = velocity_m_s + force_n * dt_s / mass_kg
        sliding_m_s = coulomb_friction.stick_or_slide_m_s(free_m_s, level_n, mass_kg, dt_s)
        after_m_s = sliding_m_s / (1.0 + damping * dt_s / mass_kg)
    s.friction_n = force_n - mass_kg * (after_m_s - velocity_m_s) / dt_s
    return after_m_s if abs(after_m_s) > NEGLIGIBLE_M_S else 0.0


@kernel
def transmitted_force_n(p: Any, gap_m: float, rate_m_s: float) -> float:
    """Force (N) from screw to table across the gap (m) between them, opening at `rate_m_s`."""
    if not p.backlash.enabled:
        return drive_compliance.force_n(p.drive_compliance, gap_m, rate_m_s)
    deflection_m = backlash.deflection_m(p.backlash, gap_m)
    if deflection_m == 0.0 and p.backlash.play_m > 0.0:
        return 0.0
    force = drive_compliance.force_n(p.drive_compliance, deflection_m, rate_m_s)
    return backlash.contact_n(p.backlash, force, deflection_m)


@kernel
def mechanics_step(p: Any, s: Any, dt_s: float) -> None:
    """Advance positions and velocities of one axis by `dt_s` (s) under the present motor current."""
    m = p.mechanics
    turn_rad_m = 2.0 * math.pi / m.lead_m
    motor_n = motor_force_n(p, s, turn_rad_m)
    load_n = load_force_n(p, s, turn_rad_m)
    if p.structural_mode.enabled:
        load_n += swing(p, s, dt_s)
    if p.drive_compliance.enabled:
        error_m, slope = nominal_error(p, s.motor_position_m, turn_rad_m, s.temperature_k)
        gap_m = s.motor_position_m + error_m - s.table_position_m
        rate_m_s = s.motor_velocity_m_s * (1.0 + slope) - s.table_velocity_m_s
        s.transmitted_n = transmitted_force_n(p, gap_m, rate_m_s)
        s.motor_velocity_m_s += (motor_n - s.transmitted_n * (1.0 + slope)) * dt_s / m.motor_mass_kg
        table_n = s.transmitted_n + load_n
        s.table_velocity_m_s = slide(p, s, m.table_mass_kg, s.table_velocity_m_s, table_n, dt_s)
        s.motor_position_m += dt_s * s.motor_velocity_m_s
        s.table_position_m += dt_s * s.table_velocity_m_s
    else:
        # one mass; the ratio 1 + slope differs from 1 by 1e-4 and is left out of the balance of forces
        mass_kg = m.motor_mass_kg + m.table_mass_kg
        velocity_m_s = slide(p, s, mass_kg, s.motor_velocity_m_s, motor_n + load_n, dt_s)
        s.transmitted_n = motor_n - m.motor_mass_kg * (velocity_m_s - s.motor_velocity_m_s) / dt_s
        s.motor_velocity_m_s = velocity_m_s
        s.motor_position_m += dt_s * velocity_m_s
        error_m, slope = nominal_error(p, s.motor_position_m, turn_rad_m, s.temperature_k)
        s.table_position_m = s.motor_position_m + error_m
        s.table_velocity_m_s = velocity_m_s * (1.0 + slope)
    if p.structural_mode.enabled:
        s.carried_position_m += dt_s * s.carried_velocity_m_s
    friction_w = s.friction_n * s.table_velocity_m_s
    if p.thermal_expansion.enabled:
        s.temperature_k = thermal_expansion.temperature_after_k(
            p.thermal_expansion, s.temperature_k, friction_w, dt_s
        )
    if p.friction_warm_up.enabled:
        s.lubricant_warmth_k = friction_warm_up.warmth_after_k(
            p.friction_warm_up, s.lubricant_warmth_k, friction_w, dt_s
        )
    if p.friction_ageing.enabled:
        s.travelled_m += abs(s.table_velocity_m_s) * dt_s
