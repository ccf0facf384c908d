"""Velocity estimate and proportional-integral velocity loop (Feng et al. 2015, section 2).

u = kv e + I,  I[k] = I[k-1] + ki T e[k],  e = velocity set point - estimate.

Anti-windup: while the force is at its limit, the integral takes no step that would push it further out. The
integral alone never exceeds the limit.
"""

import math
from typing import Annotated, NamedTuple

from kernels.jit import kernel
from kernels.quantities import Quantity
from servo_ctrl.control.limits import clamp


class Params(NamedTuple):
    """Proportional and integral gain on the motor's velocity, and the velocity estimate."""

    kv_n_s_m: Annotated[float, Quantity("N s/m", 0.0, math.inf, "force per velocity error")]
    ki_n_m: Annotated[float, Quantity("N/m", 0.0, math.inf, "integral gain")]
    window_samples: Annotated[int, Quantity("", 1.0, 2.0, "velocity is (q[k] - q[k-n]) / (n T)")]
    filter_blend: Annotated[
        float, Quantity("", 0.0, 1.0, "share of the new value in the low pass, > 0; 1 = no filter")
    ]


class State(NamedTuple):
    """State of the velocity loop."""

    position_1_m: float
    """Motor position one sample ago."""
    position_2_m: float
    """Motor position two samples ago."""
    velocity_m_s: float
    """Filtered velocity estimate."""
    integral_n: float


@kernel
def at_rest(motor_position_m: float) -> State:
    """State of a motor at rest at this position, with an empty integral."""
    return State(
        position_1_m=motor_position_m, position_2_m=motor_position_m, velocity_m_s=0.0, integral_n=0.0
    )


@kernel
def after_bad_sample(state: State, position_m: float, period_s: float) -> State:
    """State after a bad sample: estimate and integral keep their values.

    An absent position (NaN) is extrapolated at the last velocity, so that the next good sample does not look
    like a jump.
    """
    if not math.isfinite(position_m):
        position_m = state.position_1_m + state.velocity_m_s * period_s
    return State(position_m, state.position_1_m, state.velocity_m_s, state.integral_n)


@kernel
def estimated_velocity(p: Params, state: State, position_m: float, period_s: float) -> float:
    """Velocity of the motor, m/s, from its position now, one and two samples ago, low-pass filtered.

    Two samples are the two-tap average followed by a difference: (q[k] - q[k-2]) / 2T.
    """
    if p.window_samples == 1:
        difference_m_s = (position_m - state.position_1_m) / period_s
    else:
        difference_m_s = (position_m - state.position_2_m) / (2.0 * period_s)
    return state.velocity_m_s + p.filter_blend * (difference_m_s - state.velocity_m_s)


@kernel
def force_setpoint(
    p: Params, integral_n: float, error_m_s: float, feedforward_n: float, limit_n: float, period_s: float
) -> tuple[float, float]:
    """Force set point within +-`limit_n`, and the new integral, N."""
    stepped_n = clamp(integral_n + p.ki_n_m * period_s * error_m_s, limit_n)
    wanted_n = p.kv_n_s_m * error_m_s + stepped_n + feedforward_n
    force_n = clamp(wanted_n, limit_n)
    if (wanted_n - force_n) * error_m_s > 0.0:
        # at the limit, and the step would push further out: do not take it
        stepped_n = clamp(integral_n, limit_n)
        force_n = clamp(p.kv_n_s_m * error_m_s + stepped_n + feedforward_n, limit_n)
    return force_n, stepped_n
