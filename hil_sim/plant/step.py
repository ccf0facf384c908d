"""One axis, one substep: the effects composed in a fixed order.

Semi-implicit Euler: forces from the positions of step n, velocities with damping taken implicitly, positions
with the new velocities. Adding an effect touches its own file, one line in a sum below, and one in
`presence`.

Friction acts on the table (Xia et al., equation 5), see `sliding`; the motor's force is in `motor_force`.

Lead errors and growth shift the table against the screw: the coupling acts on the shifted distance, and by
virtual work on the motor with the same ratio.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from hil_sim.physics.friction import temperature_dependent_friction
from hil_sim.physics.jit import kernel
from hil_sim.physics.load import (
    constant_force,
    payload_mass,
    periodic_disturbance,
    position_dependent_force,
    structural_mode,
)
from hil_sim.physics.transmission import (
    backlash,
    drive_compliance,
    lead_error_cumulative,
    lead_error_periodic,
    thermal_expansion,
)
from hil_sim.plant.motor_force import motor_force_n
from hil_sim.plant.sliding import NEGLIGIBLE_M_S, slide

if TYPE_CHECKING:
    from hil_sim.plant.presence import Presence


@kernel
def load_force_n(p: Any, s: Any, turn_rad_m: float) -> float:
    """Sum of the forces from outside on the table (N)."""
    force = 0.0
    if p.constant_force.enabled:
        force += constant_force.force_n(p.constant_force, s.table_position_m, turn_rad_m)
    return force


@kernel
def more_load_force_n(p: Any, s: Any, turn_rad_m: float) -> float:
    """Sum of the less common of them (N)."""
    force = 0.0
    if p.position_dependent_force.enabled:
        shape = p.position_dependent_force
        force += position_dependent_force.force_n(shape, s.table_position_m, turn_rad_m)
    if p.periodic_disturbance.enabled:
        force += periodic_disturbance.force_n(p.periodic_disturbance, s.time_s)
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
def mechanics_step(p: Any, s: Any, has: Presence, dt_s: float) -> None:
    """Advance positions and velocities of one axis by `dt_s` (s) under the present motor current."""
    m = p.mechanics
    turn_rad_m = 2.0 * math.pi / m.lead_m
    motor_n = motor_force_n(p, s, has.current_path, turn_rad_m, dt_s)
    load_n = load_force_n(p, s, turn_rad_m)
    table_kg = m.table_mass_kg
    if has.load:
        load_n += more_load_force_n(p, s, turn_rad_m)
        if p.payload_mass.enabled:
            table_kg += payload_mass.added_kg(p.payload_mass)
    if p.structural_mode.enabled:
        load_n += swing(p, s, dt_s)
    if p.drive_compliance.enabled:
        error_m, slope = nominal_error(p, s.motor_position_m, turn_rad_m, s.temperature_k)
        gap_m = s.motor_position_m + error_m - s.table_position_m
        rate_m_s = s.motor_velocity_m_s * (1.0 + slope) - s.table_velocity_m_s
        s.transmitted_n = transmitted_force_n(p, gap_m, rate_m_s)
        s.motor_velocity_m_s += (motor_n - s.transmitted_n * (1.0 + slope)) * dt_s / m.motor_mass_kg
        table_n = s.transmitted_n + load_n
        s.table_velocity_m_s = slide(p, s, has.friction, table_kg, s.table_velocity_m_s, table_n, dt_s)
        s.motor_position_m += dt_s * s.motor_velocity_m_s
        s.table_position_m += dt_s * s.table_velocity_m_s
    else:
        # one mass; the ratio 1 + slope differs from 1 by 1e-4 and is left out of the balance of forces
        mass_kg = m.motor_mass_kg + table_kg
        velocity_m_s = slide(p, s, has.friction, mass_kg, s.motor_velocity_m_s, motor_n + load_n, dt_s)
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
    if p.temperature_dependent_friction.enabled:
        s.lubricant_warmth_k = temperature_dependent_friction.warmth_after_k(
            p.temperature_dependent_friction, s.lubricant_warmth_k, friction_w, dt_s
        )
    if p.friction_ageing.enabled:
        s.travelled_m += abs(s.table_velocity_m_s) * dt_s
