"""Position loop of the cascade: proportional (Feng et al. 2015, section 2), PID, or fuzzy-PD (Xia et al.).

    v = kp e + I + kd de/dt,   I[k] = I[k-1] + ki T e[k]

de/dt is the low-passed difference of the error. Anti-windup: while the set point is at its limit, the
integral takes no step that would push it further out. With fuzzy-PD the integral acts within e1 only, and
starts there from 0.
"""

import math
from typing import Annotated, NamedTuple

from kernels.jit import kernel
from kernels.quantities import Quantity
from servo_ctrl.control.compensation import fuzzy_pd
from servo_ctrl.control.compensation.fuzzy_pd import fuzzy_setpoint


class Params(NamedTuple):
    """Proportional, integral and derivative gain."""

    kp_1_s: Annotated[float, Quantity("1/s", 0.0, math.inf, "velocity per position error")]
    ki_1_s2: Annotated[float, Quantity("1/s2", 0.0, math.inf, "integral gain")]
    kd: Annotated[float, Quantity("", 0.0, math.inf, "velocity per change of the error")]
    derivative_blend: Annotated[
        float, Quantity("", 0.0, 1.0, "share of the new value in the low pass of the error's change, > 0")
    ]
    scale_feedback: bool
    """True: the position loop uses the scale; False: the motor encoder."""


class State(NamedTuple):
    """State of the position loop."""

    error_m: float
    """Error of the last sample; NaN after a bad one."""
    change_m_s: float
    """Filtered change of the error."""
    integral_m_s: float


@kernel
def at_rest() -> State:
    """State of an axis at rest without an error."""
    return State(error_m=0.0, change_m_s=0.0, integral_m_s=0.0)


@kernel
def after_bad_sample(state: State) -> State:
    """State after a sample without an error: the next sample has no difference."""
    return State(error_m=math.nan, change_m_s=state.change_m_s, integral_m_s=state.integral_m_s)


@kernel
def changed_error(p: Params, state: State, error_m: float, period_s: float) -> float:
    """Filtered de/dt, m/s."""
    if not math.isfinite(state.error_m):  # after a bad sample there is no difference
        return state.change_m_s
    difference_m_s = (error_m - state.error_m) / period_s
    return state.change_m_s + p.derivative_blend * (difference_m_s - state.change_m_s)


@kernel
def velocity_setpoint(
    p: Params,
    fuzzy: fuzzy_pd.Params,
    state: State,
    error_m: float,
    feedforward_m_s: float,
    limit_m_s: float,
    period_s: float,
) -> tuple[float, State]:
    """Velocity set point (m/s) with feedforward, not yet limited, and the next state.

    `limit_m_s`: limit of the set point, for the anti-windup.
    """
    change_m_s = changed_error(p, state, error_m, period_s)
    wanted_m_s = p.kp_1_s * error_m + p.kd * change_m_s
    gain_1_s2, integral_m_s = p.ki_1_s2, state.integral_m_s
    if fuzzy.enabled:
        wanted_m_s = fuzzy_setpoint(fuzzy, error_m, change_m_s, wanted_m_s)
        gain_1_s2 = fuzzy.ki_1_s2
        if abs(error_m) > fuzzy.fine_m:
            gain_1_s2, integral_m_s = 0.0, 0.0
    wanted_m_s += feedforward_m_s
    stepped_m_s = integral_m_s + gain_1_s2 * period_s * error_m
    if abs(wanted_m_s + stepped_m_s) > limit_m_s and (wanted_m_s + stepped_m_s) * error_m > 0.0:
        stepped_m_s = integral_m_s
    return wanted_m_s + stepped_m_s, State(error_m, change_m_s, stepped_m_s)
