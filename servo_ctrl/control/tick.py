"""The control law of one axis for one SYNC period: the one function that daemon and batch twin share.

    x* = x_command + c                                       screw error, take-up, sampled dual loop
    v* = clamp(kp (x* - x) + kff v*_command + p)             position loop, feedforward, friction pulse
    u  = clamp(kv (v* - v) + I + M a*_command + d)           velocity loop, feedforward, observer

The position loop may be PID or fuzzy-PD. c leads the motor: it counts in CSP, and where the position loop is
closed on the motor; a loop that is closed on the scale has the table itself.

With ki = 0 and no feedforward this is u = kp kv (x* - x) - kv v, the law of the EMPS benchmark.
"""

import math
from typing import Annotated, NamedTuple

from kernels.jit import kernel
from kernels.quantities import Quantity
from servo_ctrl.control import position_loop, velocity_loop
from servo_ctrl.control.compensation import (
    backlash,
    disturbance_observer,
    feedforward,
    fuzzy_pd,
    sampled_dual_loop,
    screw_error,
    trapezoidal_pulse,
)
from servo_ctrl.control.limits import clamp
from servo_ctrl.control.offset_motion import OffsetMotion, offset_m, over, resting, shifted
from servo_ctrl.control.types import (
    BAD_COMMAND,
    BAD_MOTOR_SAMPLE,
    AxisCommand,
    AxisSample,
    Output,
    Status,
    sample_status,
)

_OUTPUT_FORCE = int(Output.FORCE)  # plain ints: an enumeration would compile to another type
_FOLLOWING_ERROR = int(Status.FOLLOWING_ERROR)


class AxisLimits(NamedTuple):
    """Bounds of the commands and of the position error."""

    velocity_m_s: Annotated[float, Quantity("m/s", 0.0, math.inf, "of the velocity set point, > 0")]
    force_n: Annotated[float, Quantity("N", 0.0, math.inf, "of the force set point, > 0")]
    following_error_m: Annotated[float, Quantity("m", 0.0, math.inf, "of the position error, > 0")]


class AxisParams(NamedTuple):
    """What an axis is made of; constant from one change of settings to the next."""

    period_s: float
    output: int
    """An `Output`, as a plain int."""
    position_loop: position_loop.Params
    fuzzy: fuzzy_pd.Params
    velocity_loop: velocity_loop.Params
    feedforward: feedforward.Params
    pulse: trapezoidal_pulse.Params
    observer: disturbance_observer.Params
    screw: screw_error.Params
    take_up: backlash.Params
    sampled: sampled_dual_loop.Params
    limits: AxisLimits


class AxisState(NamedTuple):
    """What one tick hands to the next."""

    motor_position_1_m: float
    """Motor position one sample ago."""
    motor_position_2_m: float
    """Motor position two samples ago."""
    velocity_m_s: float
    """Filtered velocity estimate."""
    integral_n: float
    """Integral part of the velocity loop."""
    velocity_command_m_s: float
    """Last velocity set point, held through a bad sample."""
    force_n: float
    """Last force set point, held through a bad sample."""
    position_loop: position_loop.State
    pulse: trapezoidal_pulse.State
    observer: disturbance_observer.State
    screw_error_m: float
    """At the last position command, by the table of that tick."""
    take_up: OffsetMotion
    sampled: sampled_dual_loop.State


@kernel
def at_rest(motor_position_m: float) -> AxisState:
    """An axis at rest there (metres), with nothing in its integrators."""
    return AxisState(
        motor_position_1_m=motor_position_m,
        motor_position_2_m=motor_position_m,
        velocity_m_s=0.0,
        integral_n=0.0,
        velocity_command_m_s=0.0,
        force_n=0.0,
        position_loop=position_loop.at_rest(),
        pulse=trapezoidal_pulse.at_rest(motor_position_m),
        observer=disturbance_observer.at_rest(),
        screw_error_m=0.0,
        take_up=resting(),
        sampled=sampled_dual_loop.at_rest(),
    )


@kernel
def held(
    params: AxisParams, state: AxisState, sample: AxisSample, status: int
) -> tuple[AxisState, AxisCommand]:
    """A tick that cannot be computed: the last set points stand and the integral rests.

    The motor position is carried on at the last velocity, so that the first good sample does not
    look like a jump. The pulse goes on with time and command, the screw error with the command; the observer
    rests until its samples are whole, and the other corrections stand where they are. Nothing that is not
    finite is passed on.
    """
    take_up = led_in(params, state)
    position_1_m = sample.motor_position_m
    if status & BAD_MOTOR_SAMPLE:
        position_1_m = state.motor_position_1_m + state.velocity_m_s * params.period_s
    if status & BAD_COMMAND:
        pulse = trapezoidal_pulse.older_pulse(state.pulse, params.period_s)
    else:
        pulse = trapezoidal_pulse.advance_pulse(
            params.pulse,
            state.pulse,
            sample.position_command_m,
            sample.acceleration_command_m_s2,
            params.period_s,
        )
    position_m = pulse.position_command_m if status & BAD_COMMAND else sample.position_command_m
    screw_m = screw_error.screw_error_m(params.screw, position_m)
    state = AxisState(
        motor_position_1_m=position_1_m,
        motor_position_2_m=state.motor_position_1_m,
        velocity_m_s=state.velocity_m_s,
        integral_n=state.integral_n,
        velocity_command_m_s=state.velocity_command_m_s,
        force_n=state.force_n,
        position_loop=position_loop.after_bad_sample(state.position_loop),
        pulse=pulse,
        observer=disturbance_observer.after_bad_sample(state.observer),
        screw_error_m=screw_m,
        take_up=take_up,
        sampled=state.sampled,
    )
    offset_n = sample.force_offset_n if math.isfinite(sample.force_offset_n) else 0.0
    command = AxisCommand(
        position_m=position_m,
        velocity_m_s=state.velocity_command_m_s,
        force_n=state.force_n,
        force_offset_n=offset_n,
        position_error_m=math.nan,
        motor_velocity_m_s=state.velocity_m_s,
        pulse_m_s=0.0,
        disturbance_n=0.0,
        correction_m=offset_m(take_up) + offset_m(state.sampled.motion) - screw_m,
        saturated=False,
        status=status,
    )
    return state, command


@kernel
def led_in(params: AxisParams, state: AxisState) -> OffsetMotion:
    """The take-up, from where the motor is led by now although the table of screw errors may be another."""
    now_m = screw_error.screw_error_m(params.screw, state.pulse.position_command_m)
    return shifted(state.take_up, now_m - state.screw_error_m)


@kernel
def axis_tick(params: AxisParams, state: AxisState, sample: AxisSample) -> tuple[AxisState, AxisCommand]:
    """One period of one axis: the next state and the commands. Never raises; see `Status`."""
    status = sample_status(sample, params.position_loop.scale_feedback)
    if status != 0:
        return held(params, state, sample, status)

    moving = abs(sample.position_command_m - state.pulse.position_command_m) >= trapezoidal_pulse.REST_M
    pulse = trapezoidal_pulse.advance_pulse(
        params.pulse,
        state.pulse,
        sample.position_command_m,
        sample.acceleration_command_m_s2,
        params.period_s,
    )
    screw_m = screw_error.screw_error_m(params.screw, sample.position_command_m)
    take_up = backlash.advance_take_up(
        params.take_up, led_in(params, state), pulse.direction, params.period_s
    )
    deviation_m = sample.position_command_m - sample.scale_position_m
    sampled = sampled_dual_loop.advance_sampled(
        params.sampled, state.sampled, deviation_m, moving or not over(take_up), params.period_s
    )
    led_m = offset_m(take_up) + offset_m(sampled.motion) - screw_m

    feedback_m = position_loop.feedback_position(
        params.position_loop, sample.motor_position_m, sample.scale_position_m
    )
    error_m = sample.position_command_m - feedback_m
    if not params.position_loop.scale_feedback:
        error_m += led_m
    if abs(error_m) > params.limits.following_error_m:
        status |= _FOLLOWING_ERROR

    friction_m_s = trapezoidal_pulse.pulse_m_s(params.pulse, pulse)
    wanted_m_s, position_state = position_loop.velocity_setpoint(
        params.position_loop,
        params.fuzzy,
        state.position_loop,
        error_m,
        feedforward.velocity_feedforward(params.feedforward, sample.velocity_command_m_s) + friction_m_s,
        params.limits.velocity_m_s,
        params.period_s,
    )
    velocity_command_m_s = clamp(wanted_m_s, params.limits.velocity_m_s)
    velocity_m_s = velocity_loop.estimated_velocity(
        params.velocity_loop,
        last_estimate_m_s=state.velocity_m_s,
        position_m=sample.motor_position_m,
        position_1_m=state.motor_position_1_m,
        position_2_m=state.motor_position_2_m,
        period_s=params.period_s,
    )
    observer = disturbance_observer.observed_disturbance(
        params.observer, state.observer, sample.motor_force_n, velocity_m_s, params.period_s
    )

    feedforward_n = feedforward.acceleration_feedforward(params.feedforward, sample.acceleration_command_m_s2)
    offset_n = sample.force_offset_n
    if params.output == _OUTPUT_FORCE:
        force_n, integral_n = velocity_loop.force_setpoint(
            params.velocity_loop,
            state.integral_n,
            velocity_command_m_s - velocity_m_s,
            feedforward_n + observer.disturbance_n,
            params.limits.force_n,
            params.period_s,
        )
    else:
        force_n, integral_n = 0.0, 0.0
        offset_n += clamp(feedforward_n, params.limits.force_n)
    saturated = abs(wanted_m_s) > params.limits.velocity_m_s or abs(force_n) >= params.limits.force_n

    state = AxisState(
        motor_position_1_m=sample.motor_position_m,
        motor_position_2_m=state.motor_position_1_m,
        velocity_m_s=velocity_m_s,
        integral_n=integral_n,
        velocity_command_m_s=velocity_command_m_s,
        force_n=force_n,
        position_loop=position_state,
        pulse=pulse,
        observer=observer,
        screw_error_m=screw_m,
        take_up=take_up,
        sampled=sampled,
    )
    command = AxisCommand(
        position_m=sample.position_command_m,
        velocity_m_s=velocity_command_m_s,
        force_n=force_n,
        force_offset_n=offset_n,
        position_error_m=error_m,
        motor_velocity_m_s=velocity_m_s,
        pulse_m_s=friction_m_s,
        disturbance_n=observer.disturbance_n,
        correction_m=led_m,
        saturated=saturated,
        status=status,
    )
    return state, command


def initial_state(motor_position_m: float) -> AxisState:
    """`at_rest`, for a position that may be anything; raises ValueError where it is not finite."""
    position_m = float(motor_position_m)
    if not math.isfinite(position_m):
        raise ValueError(f"an axis cannot start at motor position {position_m}")
    return at_rest(position_m)
