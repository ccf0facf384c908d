"""The control law of one axis for one SYNC period: the one function that daemon and batch twin share.

    x* = x_command + c                                       screw error, take-up, sampled dual loop
    v* = clamp(kp (x* - x) + kff v*_command + p)             position loop, feedforward, friction pulse
    u  = clamp(kv (v* - v) + I + M a*_command + d)           velocity loop, feedforward, observer

The position loop may be PID or fuzzy-PD. c leads the motor: it counts in CSP, and where the position loop is
closed on the motor; a loop that is closed on the scale has the table itself.

With ki = 0 and no feedforward this is u = kp kv (x* - x) - kv v, the law of the EMPS benchmark.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from servo_ctrl.control.compensation.backlash import advance_take_up
from servo_ctrl.control.compensation.screw_error import screw_error_m
from servo_ctrl.control.compensation.trapezoidal_pulse import REST_M, advance_pulse, older_pulse, pulse_m_s
from servo_ctrl.control.disturbance_observer import observed_disturbance
from servo_ctrl.control.feedforward import acceleration_feedforward, velocity_feedforward
from servo_ctrl.control.jit import kernel
from servo_ctrl.control.limits import clamp
from servo_ctrl.control.offset_motion import offset_m, over, shifted
from servo_ctrl.control.position_loop import feedback_position, velocity_setpoint
from servo_ctrl.control.sampled_dual_loop import advance_sampled
from servo_ctrl.control.types import (
    AxisCommand,
    AxisSample,
    AxisState,
    ObserverState,
    PositionState,
)
from servo_ctrl.control.velocity_loop import estimated_velocity, force_setpoint

if TYPE_CHECKING:
    from servo_ctrl.control.params import AxisParams
    from servo_ctrl.control.types import OffsetMotion

# plain ints: numba bakes them in, and an IntFlag would compile to another type
_OUTPUT_FORCE = 0
_BAD_COMMAND = 1
_BAD_MOTOR_SAMPLE = 2
_BAD_SCALE_SAMPLE = 4
_FOLLOWING_ERROR = 8


@kernel
def sample_status(params: AxisParams, sample: AxisSample) -> int:
    """`Status` bits of a sample whose values are absent (NaN) or not finite; 0 is a good one."""
    status = 0
    if not (
        math.isfinite(sample.position_command_m)
        and math.isfinite(sample.velocity_command_m_s)
        and math.isfinite(sample.acceleration_command_m_s2)
        and math.isfinite(sample.force_offset_n)
    ):
        status |= _BAD_COMMAND
    if not math.isfinite(sample.motor_position_m):
        status |= _BAD_MOTOR_SAMPLE
    if params.position_loop.scale_feedback and not math.isfinite(sample.scale_position_m):
        status |= _BAD_SCALE_SAMPLE
    return status


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
    if status & _BAD_MOTOR_SAMPLE:
        position_1_m = state.motor_position_1_m + state.velocity_m_s * params.period_s
    if status & _BAD_COMMAND:
        pulse = older_pulse(state.pulse, params.period_s)
    else:
        pulse = advance_pulse(
            params.pulse,
            state.pulse,
            sample.position_command_m,
            sample.acceleration_command_m_s2,
            params.period_s,
        )
    position_m = pulse.position_command_m if status & _BAD_COMMAND else sample.position_command_m
    screw_m = screw_error_m(params.screw, position_m)
    state = AxisState(
        position_1_m,
        state.motor_position_1_m,
        state.velocity_m_s,
        state.integral_n,
        state.velocity_command_m_s,
        state.force_n,
        PositionState(math.nan, state.position_loop.change_m_s, state.position_loop.integral_m_s),
        pulse,
        ObserverState(state.observer.disturbance_n, math.nan, math.nan),
        screw_m,
        take_up,
        state.sampled,
    )
    offset_n = sample.force_offset_n if math.isfinite(sample.force_offset_n) else 0.0
    command = AxisCommand(
        position_m,
        state.velocity_command_m_s,
        state.force_n,
        offset_n,
        math.nan,
        state.velocity_m_s,
        0.0,
        0.0,
        offset_m(take_up) + offset_m(state.sampled.motion) - screw_m,
        False,
        status,
    )
    return state, command


@kernel
def led_in(params: AxisParams, state: AxisState) -> OffsetMotion:
    """The take-up, from where the motor is led by now although the table of screw errors may be another."""
    now_m = screw_error_m(params.screw, state.pulse.position_command_m)
    return shifted(state.take_up, now_m - state.screw_error_m)


@kernel
def axis_tick(params: AxisParams, state: AxisState, sample: AxisSample) -> tuple[AxisState, AxisCommand]:
    """One period of one axis: the next state and the commands. Never raises; see `Status`."""
    status = sample_status(params, sample)
    if status != 0:
        return held(params, state, sample, status)

    moving = abs(sample.position_command_m - state.pulse.position_command_m) >= REST_M
    pulse = advance_pulse(
        params.pulse,
        state.pulse,
        sample.position_command_m,
        sample.acceleration_command_m_s2,
        params.period_s,
    )
    screw_m = screw_error_m(params.screw, sample.position_command_m)
    take_up = advance_take_up(params.take_up, led_in(params, state), pulse.direction, params.period_s)
    deviation_m = sample.position_command_m - sample.scale_position_m
    sampled = advance_sampled(
        params.sampled, state.sampled, deviation_m, moving or not over(take_up), params.period_s
    )
    led_m = offset_m(take_up) + offset_m(sampled.motion) - screw_m

    feedback_m = feedback_position(params.position_loop, sample.motor_position_m, sample.scale_position_m)
    error_m = sample.position_command_m - feedback_m
    if not params.position_loop.scale_feedback:
        error_m += led_m
    if abs(error_m) > params.limits.following_error_m:
        status |= _FOLLOWING_ERROR

    friction_m_s = pulse_m_s(params.pulse, pulse)
    wanted_m_s, position_loop = velocity_setpoint(
        params.position_loop,
        params.fuzzy,
        state.position_loop,
        error_m,
        velocity_feedforward(params.feedforward, sample.velocity_command_m_s) + friction_m_s,
        params.limits.velocity_m_s,
        params.period_s,
    )
    velocity_command_m_s = clamp(wanted_m_s, params.limits.velocity_m_s)
    velocity_m_s = estimated_velocity(params.velocity_loop, state, sample.motor_position_m, params.period_s)
    observer = observed_disturbance(
        params.observer, state.observer, sample.motor_force_n, velocity_m_s, params.period_s
    )

    feedforward_n = acceleration_feedforward(params.feedforward, sample.acceleration_command_m_s2)
    offset_n = sample.force_offset_n
    if params.output == _OUTPUT_FORCE:
        force_n, integral_n = force_setpoint(
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
        sample.motor_position_m,
        state.motor_position_1_m,
        velocity_m_s,
        integral_n,
        velocity_command_m_s,
        force_n,
        position_loop,
        pulse,
        observer,
        screw_m,
        take_up,
        sampled,
    )
    command = AxisCommand(
        sample.position_command_m,
        velocity_command_m_s,
        force_n,
        offset_n,
        error_m,
        velocity_m_s,
        friction_m_s,
        observer.disturbance_n,
        led_m,
        saturated,
        status,
    )
    return state, command
