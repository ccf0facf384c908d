"""Velocity estimate and proportional-integral velocity loop (Feng et al. 2015, section 2).

u = kv e + I,  I[k] = I[k-1] + ki T e[k],  e = velocity set point - estimate.

Anti-windup: while the force is at its limit the integral takes no step that would push it further
out, and it never exceeds the limit by itself.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from servo_ctrl.control.jit import kernel
from servo_ctrl.control.limits import clamp

if TYPE_CHECKING:
    from servo_ctrl.control.params import VelocityLoop
    from servo_ctrl.control.types import AxisState


@kernel
def estimated_velocity(p: VelocityLoop, state: AxisState, motor_position_m: float, period_s: float) -> float:
    """Velocity of the motor, m/s, from its position now and one or two samples ago.

    Two samples are the two-tap average followed by a difference: (q[k] - q[k-2]) / 2T.
    """
    if p.window_samples == 1:
        difference_m_s = (motor_position_m - state.motor_position_1_m) / period_s
    else:
        difference_m_s = (motor_position_m - state.motor_position_2_m) / (2.0 * period_s)
    return state.velocity_m_s + p.filter_blend * (difference_m_s - state.velocity_m_s)


@kernel
def force_setpoint(
    p: VelocityLoop,
    integral_n: float,
    velocity_error_m_s: float,
    feedforward_n: float,
    limit_n: float,
    period_s: float,
) -> tuple[float, float]:
    """Force within +-`limit_n` and the new integral, both newtons."""
    stepped_n = clamp(integral_n + p.ki_n_m * period_s * velocity_error_m_s, limit_n)
    wanted_n = p.kv_n_s_m * velocity_error_m_s + stepped_n + feedforward_n
    force_n = clamp(wanted_n, limit_n)
    if (wanted_n - force_n) * velocity_error_m_s > 0.0:
        # at the limit and pushing outwards: the step is not taken
        stepped_n = clamp(integral_n, limit_n)
        force_n = clamp(p.kv_n_s_m * velocity_error_m_s + stepped_n + feedforward_n, limit_n)
    return force_n, stepped_n
