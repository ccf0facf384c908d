"""One axis, one substep: the effects composed in a fixed order.

Semi-implicit Euler: forces from the positions of step n, velocities with damping taken implicitly, positions
with the new velocities. Adding an effect touches its own file and one line here.
"""

from __future__ import annotations

from typing import Any

from hil_sim.physics.friction import coulomb_friction, viscous_friction
from hil_sim.physics.jit import kernel
from hil_sim.physics.load import constant_force


@kernel
def friction_level_n(p: Any, speed_m_s: float) -> float:
    """Sum of the friction levels (N) at a sliding speed (m/s)."""
    level = 0.0
    if p.coulomb_friction.enabled:
        level += coulomb_friction.level_n(p.coulomb_friction, speed_m_s)
    return level


@kernel
def damping_n_s_m(p: Any) -> float:
    """Sum of the damping coefficients on the table (N s/m)."""
    damping = 0.0
    if p.viscous_friction.enabled:
        damping += viscous_friction.damping_n_s_m(p.viscous_friction)
    return damping


@kernel
def load_n(p: Any) -> float:
    """Sum of the forces from outside on the table (N)."""
    force = 0.0
    if p.constant_force.enabled:
        force += constant_force.force_n(p.constant_force)
    return force


@kernel
def mechanics_step(p: Any, s: Any, dt_s: float) -> None:
    """Advance positions and velocities of one axis by `dt_s` under the present motor current."""
    m = p.mechanics
    mass_kg = m.motor_mass_kg + m.table_mass_kg
    force_n = m.force_constant_n_a * s.current_a + load_n(p)
    level_n = friction_level_n(p, abs(s.table_velocity_m_s))
    free_m_s = s.table_velocity_m_s + force_n * dt_s / mass_kg
    velocity_m_s = coulomb_friction.stick_or_slide_m_s(free_m_s, level_n, mass_kg, dt_s)
    velocity_m_s /= 1.0 + damping_n_s_m(p) * dt_s / mass_kg
    s.motor_velocity_m_s = velocity_m_s
    s.table_velocity_m_s = velocity_m_s
    s.motor_position_m += dt_s * velocity_m_s
    s.table_position_m += dt_s * velocity_m_s
