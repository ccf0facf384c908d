"""Advances one axis by one substep: composes the effects in a fixed order.

The method is semi-implicit Euler: forces from the positions of step n, velocities with implicit damping,
positions with the new velocities. An effect in the registry is part of the sum of its kind.

Friction acts on the table (Xia et al., equation 5), see `sliding`; the motor's force is in `motor_force`.

Lead errors and expansion shift the table against the screw: the coupling acts on the shifted distance, and,
by virtual work, on the motor with the same ratio.
"""

import math
from typing import Any

from hil_sim.physics.kinds import Kind
from hil_sim.physics.load import structural_mode
from hil_sim.physics.registry import of_kind, with_state
from hil_sim.physics.transmission import backlash, drive_compliance
from hil_sim.plant.motor_force import motor_force_n
from hil_sim.plant.other_axes import FORCES_OF_OTHER_AXIS
from hil_sim.plant.presence import Presence
from hil_sim.plant.sliding import SPEED_MIN_M_S, slide
from kernels.jit import kernel
from kernels.unrolled import unrolled

TABLE_FORCES = of_kind(Kind.TABLE_FORCE, common=True)
LESS_COMMON_FORCES = of_kind(Kind.TABLE_FORCE, common=False)
STATE_FORCES = of_kind(Kind.STATE_FORCE, Kind.FORCE_OF_OTHER_AXIS)
FORCES_IN_TIME = of_kind(Kind.FORCE_IN_TIME)
MEMORY_FORCES = of_kind(Kind.MEMORY_FORCE)
CHANGES_IN_TIME = of_kind(Kind.CHANGE_IN_TIME)
CHANGES_WITH_POSITION = of_kind(Kind.CHANGE_WITH_POSITION)
MASSES = of_kind(Kind.MASS)
POSITION_ERRORS = of_kind(Kind.POSITION_ERROR)
HEAT_AND_WEAR = with_state(of_kind(Kind.POSITION_ERROR, Kind.FRICTION_CHANGE))


@kernel
@unrolled
def load_force_n(p: Any, s: Any, turn_rad_m: float) -> float:
    """Return the sum of the common external forces on the table (N)."""
    force = 0.0
    for effect in TABLE_FORCES:
        if p[effect].enabled:
            force += effect.force_n(p[effect], s[effect], s.table_position_m, turn_rad_m)
    return force


@kernel
@unrolled
def state_force_n(p: Any, s: Any) -> float:
    """Return the sum of the external forces on the table (N) that its velocity may change."""
    force = 0.0
    for effect in STATE_FORCES:
        if p[effect].enabled:
            force += effect.force_n(p[effect], s[effect], s.table_position_m, s.table_velocity_m_s)
    return force


@kernel
@unrolled
def less_common_load_force_n(p: Any, s: Any, turn_rad_m: float) -> float:
    """Return the sum of the less common external forces on the table (N)."""
    force = state_force_n(p, s)
    for effect in LESS_COMMON_FORCES:
        if p[effect].enabled:
            force += effect.force_n(p[effect], s[effect], s.table_position_m, turn_rad_m)
    for effect in FORCES_IN_TIME:
        if p[effect].enabled:
            force += effect.force_n(p[effect], s[effect], s.time_s)
    for effect in CHANGES_IN_TIME:
        if p[effect].enabled:
            force += effect.force_n(p[effect], s[effect], s.time_s)
    for effect in MEMORY_FORCES:
        if p[effect].enabled:
            force += effect.force_n(p[effect], s[effect])
    return force


@kernel
@unrolled
def added_mass_kg(p: Any, s: Any) -> float:
    """Return the sum of the added masses on the table (kg)."""
    mass = 0.0
    for effect in MASSES:
        if p[effect].enabled:
            mass += effect.added_kg(p[effect])
    for effect in CHANGES_IN_TIME:
        if p[effect].enabled:
            mass += effect.added_kg(p[effect], s[effect], s.time_s)
    for effect in CHANGES_WITH_POSITION:
        if p[effect].enabled:
            mass += effect.added_kg(p[effect], s[effect], s.table_position_m)
    for effect in FORCES_OF_OTHER_AXIS:
        if p[effect].enabled:
            mass += effect.added_kg(p[effect], s[effect])
    return mass


@kernel
@unrolled
def advance_memory_forces(p: Any, s: Any, dt_s: float) -> None:
    """Advance the forces with memory by a substep of `dt_s` (s)."""
    for effect in MEMORY_FORCES:
        if p[effect].enabled:
            effect.advance(p[effect], s[effect], s.table_velocity_m_s, dt_s)


@kernel
def advance_carried_mass(p: Any, s: Any, dt_s: float) -> float:
    """Advance the velocity of the carried mass by `dt_s` (s); return its force (N) on the table."""
    deflection_m = s.carried_position_m - s.table_position_m
    rate_m_s = s.carried_velocity_m_s - s.table_velocity_m_s
    force = structural_mode.force_n(p.structural_mode, deflection_m, rate_m_s)
    velocity_m_s = s.carried_velocity_m_s - force * dt_s / p.structural_mode.mass_kg
    s.carried_velocity_m_s = velocity_m_s if abs(velocity_m_s) > SPEED_MIN_M_S else 0.0
    return force


@kernel
@unrolled
def screw_error(p: Any, s: Any, position_m: float, turn_rad_m: float) -> tuple[float, float]:
    """Return the sum of the screw's position errors (m) at a motor position (m), and its derivative."""
    error_m = 0.0
    slope = 0.0
    for effect in POSITION_ERRORS:
        if p[effect].enabled:
            error_m += effect.error_m(p[effect], s[effect], position_m, turn_rad_m)
            slope += effect.slope(p[effect], s[effect], position_m, turn_rad_m)
    return error_m, slope


@kernel
@unrolled
def advance_heat_and_wear(p: Any, s: Any, dt_s: float) -> None:
    """Advance the effects of friction heat and distance travelled by a substep of `dt_s` (s)."""
    friction_w = s.friction_n * s.table_velocity_m_s
    speed_m_s = abs(s.table_velocity_m_s)
    for effect in HEAT_AND_WEAR:
        if p[effect].enabled:
            effect.advance(p[effect], s[effect], friction_w, speed_m_s, dt_s)


@kernel
def transmitted_force_n(p: Any, gap_m: float, rate_m_s: float) -> float:
    """Return the force (N) from screw to table across the gap (m), which opens at `rate_m_s`."""
    if not p.backlash.enabled:
        return drive_compliance.force_n(p.drive_compliance, gap_m, rate_m_s)
    deflection_m = backlash.deflection_m(p.backlash, gap_m)
    if deflection_m == 0.0 and p.backlash.play_m > 0.0:
        return 0.0
    force = drive_compliance.force_n(p.drive_compliance, deflection_m, rate_m_s)
    return backlash.contact_force_n(p.backlash, force, deflection_m)


@kernel
def mechanics_step(p: Any, s: Any, has: Presence, dt_s: float) -> None:
    """Advance positions and velocities of one axis by `dt_s` (s) at the present motor current."""
    m = p.mechanics
    turn_rad_m = 2.0 * math.pi / m.lead_m
    motor_n = motor_force_n(p, s, has.current_path, turn_rad_m, dt_s)
    load_n = load_force_n(p, s, turn_rad_m)
    table_kg = m.table_mass_kg
    if has.load:
        load_n += less_common_load_force_n(p, s, turn_rad_m)
        table_kg += added_mass_kg(p, s)
    if p.structural_mode.enabled:
        load_n += advance_carried_mass(p, s, dt_s)
    if p.drive_compliance.enabled:
        error_m, slope = screw_error(p, s, s.motor_position_m, turn_rad_m) if has.screw_or_use else (0.0, 0.0)
        gap_m = s.motor_position_m + error_m - s.table_position_m
        rate_m_s = s.motor_velocity_m_s * (1.0 + slope) - s.table_velocity_m_s
        s.transmitted_n = transmitted_force_n(p, gap_m, rate_m_s)
        s.motor_velocity_m_s += (motor_n - s.transmitted_n * (1.0 + slope)) * dt_s / m.motor_mass_kg
        table_n = s.transmitted_n + load_n
        s.table_velocity_m_s = slide(
            p,
            s,
            has_less_common=has.friction,
            mass_kg=table_kg,
            velocity_m_s=s.table_velocity_m_s,
            force_n=table_n,
            dt_s=dt_s,
        )
        s.motor_position_m += dt_s * s.motor_velocity_m_s
        s.table_position_m += dt_s * s.table_velocity_m_s
    else:
        # one mass; the force balance neglects the slope of the screw error, about 1e-4
        mass_kg = m.motor_mass_kg + table_kg
        velocity_m_s = slide(
            p,
            s,
            has_less_common=has.friction,
            mass_kg=mass_kg,
            velocity_m_s=s.motor_velocity_m_s,
            force_n=motor_n + load_n,
            dt_s=dt_s,
        )
        s.transmitted_n = motor_n - m.motor_mass_kg * (velocity_m_s - s.motor_velocity_m_s) / dt_s
        s.motor_velocity_m_s = velocity_m_s
        s.motor_position_m += dt_s * velocity_m_s
        error_m, slope = screw_error(p, s, s.motor_position_m, turn_rad_m) if has.screw_or_use else (0.0, 0.0)
        s.table_position_m = s.motor_position_m + error_m
        s.table_velocity_m_s = velocity_m_s * (1.0 + slope)
    if p.structural_mode.enabled:
        s.carried_position_m += dt_s * s.carried_velocity_m_s
    if has.load:
        advance_memory_forces(p, s, dt_s)
    if has.screw_or_use:
        advance_heat_and_wear(p, s, dt_s)
