"""Force of the motor: from the current that is asked for and reported to the force on the screw.

What the bus reports is `current_a`, ahead of all that follows here. Adding an effect touches its own file,
one line in a sum below, and one in `presence`.
"""

from __future__ import annotations

from typing import Any

from hil_sim.physics.jit import kernel
from hil_sim.physics.motor import (
    amplifier_dead_zone,
    cogging,
    current_loop_lag,
    torque_constant_saturation,
    torque_ripple,
    transport_delay,
    voltage_saturation,
)


@kernel
def acting_current_a(p: Any, s: Any, turn_rad_m: float, dt_s: float) -> float:
    """Current (A) that makes force at the nominal constant: what is left of the reported one, and when."""
    current = s.current_a
    back_emf_v = p.mechanics.force_constant_n_a * s.motor_velocity_m_s
    if p.amplifier_dead_zone.enabled:
        current = amplifier_dead_zone.passed_a(p.amplifier_dead_zone, s, current, back_emf_v, dt_s)
    if p.voltage_saturation.enabled:
        current = voltage_saturation.passed_a(p.voltage_saturation, s, current, back_emf_v, dt_s)
    if p.current_loop_lag.enabled:
        current = current_loop_lag.passed_a(p.current_loop_lag, s, current, back_emf_v, dt_s)
    if p.transport_delay.enabled:
        current = transport_delay.passed_a(p.transport_delay, s, current, back_emf_v, dt_s)
    if p.torque_constant_saturation.enabled:
        saturation = p.torque_constant_saturation
        current = torque_constant_saturation.passed_a(saturation, s, current, back_emf_v, dt_s)
    if p.torque_ripple.enabled:
        current *= 1.0 + torque_ripple.share(p.torque_ripple, s.motor_position_m, turn_rad_m)
    return float(current)


@kernel
def motor_force_n(p: Any, s: Any, changes_current: bool, turn_rad_m: float, dt_s: float) -> float:
    """Sum of the forces on the motor side (N)."""
    current = acting_current_a(p, s, turn_rad_m, dt_s) if changes_current else s.current_a
    force = p.mechanics.force_constant_n_a * current
    if p.cogging.enabled:
        force += cogging.force_n(p.cogging, s.motor_position_m, turn_rad_m)
    return float(force)
