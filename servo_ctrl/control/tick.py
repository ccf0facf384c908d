"""The control law of one axis for one SYNC period: the one function that daemon and batch twin share.

    x* = x_command + c                                       screw error, take-up, sampled dual loop
    v* = clamp(kp (x* - x) + kff v*_command + p + w)         position loop, feedforward, pulse, offset
    u  = clamp(kv (v* - v) + I + M a*_command + d)           velocity loop, feedforward, observer or waveform

What goes to the amplifier, u or in CSV v*, passes a notch filter. The position loop may be PID or fuzzy-PD.
c shifts the set point of the motor, so it acts in CSP and where the position loop is closed on the motor. A
position loop on the scale sees the table itself and does without it. w comes with the sample, from
`contour_control`.

With ki = 0 and no feedforward this is u = kp kv (x* - x) - kv v, the law of the EMPS benchmark.
"""

import math
from typing import NamedTuple

from kernels.jit import kernel
from servo_ctrl.control import position_loop, velocity_loop
from servo_ctrl.control.compensation import (
    backlash,
    disturbance_observer,
    feedforward,
    fuzzy_pd,
    learned_waveform,
    notch,
    sampled_dual_loop,
    screw_error,
    trapezoidal_pulse,
)
from servo_ctrl.control.limits import AxisLimits, clamp
from servo_ctrl.control.offset_motion import OffsetMotion, offset_m, over, resting
from servo_ctrl.control.types import BAD_COMMAND, AxisCommand, AxisSample, Output, Status, sample_status

_OUTPUT_FORCE = int(Output.FORCE)  # plain ints: an enumeration would compile to another type
_FOLLOWING_ERROR = int(Status.FOLLOWING_ERROR)


class AxisParams(NamedTuple):
    """Parameters of an axis; constant between two changes of settings."""

    period_s: float
    output: int
    """An `Output`, as a plain int."""
    position_loop: position_loop.Params
    fuzzy: fuzzy_pd.Params
    velocity_loop: velocity_loop.Params
    notch: notch.Params
    feedforward: feedforward.Params
    pulse: trapezoidal_pulse.Params
    observer: disturbance_observer.Params
    waveform: learned_waveform.Params
    screw: screw_error.Params
    take_up: backlash.Params
    sampled: sampled_dual_loop.Params
    limits: AxisLimits


class AxisState(NamedTuple):
    """What one tick passes to the next."""

    velocity_command_m_s: float
    """Last velocity set point, kept through a bad sample."""
    force_n: float
    """Last force set point, kept through a bad sample."""
    position_loop: position_loop.State
    velocity_loop: velocity_loop.State
    notch: notch.State
    pulse: trapezoidal_pulse.State
    observer: disturbance_observer.State
    waveform: learned_waveform.State
    screw_error_m: float
    """At the last position command, by the table of that tick."""
    take_up: OffsetMotion
    sampled: sampled_dual_loop.State


@kernel
def at_rest(motor_position_m: float) -> AxisState:
    """An axis at rest at this position, with empty integrators."""
    return AxisState(
        velocity_command_m_s=0.0,
        force_n=0.0,
        position_loop=position_loop.at_rest(),
        velocity_loop=velocity_loop.at_rest(motor_position_m),
        notch=notch.at_rest(),
        pulse=trapezoidal_pulse.at_rest(motor_position_m),
        observer=disturbance_observer.at_rest(),
        waveform=learned_waveform.at_rest(motor_position_m),
        screw_error_m=0.0,
        take_up=resting(),
        sampled=sampled_dual_loop.at_rest(),
    )


@kernel
def after_bad_sample(
    params: AxisParams, state: AxisState, sample: AxisSample, status: int
) -> tuple[AxisState, AxisCommand]:
    """Return a tick without a computable command: set points and integrals keep their values.

    Pulse and waveform follow time and command, the screw error follows the command. The observer waits for
    complete samples, and the other corrections keep their values. No value that is not finite is passed on.
    """
    take_up = screw_error.without_table_step(
        params.screw, state.take_up, state.pulse.position_command_m, state.screw_error_m
    )
    pulse, waveform = trapezoidal_pulse.older_pulse(state.pulse, params.period_s), state.waveform
    if not status & BAD_COMMAND:
        pulse = trapezoidal_pulse.advance_pulse(params.pulse, state.pulse, sample, params.period_s)
        waveform = learned_waveform.planned_force(
            params.waveform, state.waveform, pulse, sample, params.period_s
        )[1]
    screw_m = screw_error.screw_error_m(params.screw, pulse.position_command_m)
    command = AxisCommand(
        position_m=pulse.position_command_m,
        velocity_m_s=state.velocity_command_m_s,
        force_n=state.force_n,
        force_offset_n=sample.force_offset_n if math.isfinite(sample.force_offset_n) else 0.0,
        position_error_m=math.nan,
        motor_velocity_m_s=state.velocity_loop.velocity_m_s,
        pulse_m_s=0.0,
        disturbance_n=0.0,
        correction_m=offset_m(take_up) + offset_m(state.sampled.motion) - screw_m,
        saturated=False,
        status=status,
    )
    next_state = AxisState(
        velocity_command_m_s=state.velocity_command_m_s,
        force_n=state.force_n,
        position_loop=position_loop.after_bad_sample(state.position_loop),
        velocity_loop=velocity_loop.after_bad_sample(
            state.velocity_loop, sample.motor_position_m, params.period_s
        ),
        notch=state.notch,
        pulse=pulse,
        observer=disturbance_observer.after_bad_sample(state.observer),
        waveform=waveform,
        screw_error_m=screw_m,
        take_up=take_up,
        sampled=state.sampled,
    )
    return next_state, command


@kernel
def axis_tick(params: AxisParams, state: AxisState, sample: AxisSample) -> tuple[AxisState, AxisCommand]:
    """Compute one SYNC period of one axis: the next state and the commands. Never raises; see `Status`."""
    status = sample_status(sample, params.position_loop.scale_feedback)
    if status != 0:
        return after_bad_sample(params, state, sample, status)

    moving = abs(sample.position_command_m - state.pulse.position_command_m) >= trapezoidal_pulse.REST_M
    pulse = trapezoidal_pulse.advance_pulse(params.pulse, state.pulse, sample, params.period_s)
    screw_m = screw_error.screw_error_m(params.screw, sample.position_command_m)
    take_up = screw_error.without_table_step(
        params.screw, state.take_up, state.pulse.position_command_m, state.screw_error_m
    )
    take_up = backlash.advance_take_up(params.take_up, take_up, pulse.direction, params.period_s)
    deviation_m = sample.position_command_m - sample.scale_position_m
    sampled = sampled_dual_loop.advance_sampled(
        params.sampled, state.sampled, deviation_m, moving or not over(take_up), params.period_s
    )
    correction_m = offset_m(take_up) + offset_m(sampled.motion) - screw_m

    error_m = deviation_m
    if not params.position_loop.scale_feedback:
        error_m = sample.position_command_m - sample.motor_position_m + correction_m
    if abs(error_m) > params.limits.following_error_m:
        status |= _FOLLOWING_ERROR

    planned_n, waveform = learned_waveform.planned_force(
        params.waveform, state.waveform, pulse, sample, params.period_s
    )
    friction_m_s = 0.0 if params.waveform.enabled else trapezoidal_pulse.pulse_m_s(params.pulse, pulse)
    wanted_m_s, position_state = position_loop.velocity_setpoint(
        params.position_loop,
        params.fuzzy,
        state.position_loop,
        error_m,
        params.feedforward.velocity * sample.velocity_command_m_s + friction_m_s + sample.velocity_offset_m_s,
        params.limits.velocity_m_s,
        params.period_s,
    )
    velocity_command_m_s, notch_state = clamp(wanted_m_s, params.limits.velocity_m_s), state.notch
    velocity_m_s = velocity_loop.estimated_velocity(
        params.velocity_loop, state.velocity_loop, sample.motor_position_m, params.period_s
    )
    observer = disturbance_observer.observed_disturbance(
        params.observer, state.observer, sample.motor_force_n, velocity_m_s, params.period_s
    )
    disturbance_n = 0.0 if params.waveform.enabled else observer.disturbance_n
    feedforward_n = params.feedforward.acceleration_kg * sample.acceleration_command_m_s2
    offset_n = sample.force_offset_n
    if params.output == _OUTPUT_FORCE:
        force_n, integral_n = velocity_loop.force_setpoint(
            params.velocity_loop,
            state.velocity_loop.integral_n,
            velocity_command_m_s - velocity_m_s,
            feedforward_n + disturbance_n + planned_n,
            params.limits.force_n,
            params.period_s,
        )
        force_n, notch_state = notch.notched(params.notch, state.notch, force_n)
        force_n = clamp(force_n, params.limits.force_n)
    else:
        force_n, integral_n = 0.0, 0.0
        velocity_command_m_s, notch_state = notch.notched(params.notch, state.notch, velocity_command_m_s)
        velocity_command_m_s = clamp(velocity_command_m_s, params.limits.velocity_m_s)
        offset_n += clamp(feedforward_n, params.limits.force_n)

    command = AxisCommand(
        position_m=sample.position_command_m,
        velocity_m_s=velocity_command_m_s,
        force_n=force_n,
        force_offset_n=offset_n,
        position_error_m=error_m,
        motor_velocity_m_s=velocity_m_s,
        pulse_m_s=friction_m_s,
        disturbance_n=disturbance_n,
        correction_m=correction_m,
        saturated=abs(wanted_m_s) > params.limits.velocity_m_s or abs(force_n) >= params.limits.force_n,
        status=status,
    )
    next_state = AxisState(
        velocity_command_m_s=velocity_command_m_s,
        force_n=force_n,
        position_loop=position_state,
        velocity_loop=velocity_loop.State(
            sample.motor_position_m, state.velocity_loop.position_1_m, velocity_m_s, integral_n
        ),
        notch=notch_state,
        pulse=pulse,
        observer=observer,
        waveform=waveform,
        screw_error_m=screw_m,
        take_up=take_up,
        sampled=sampled,
    )
    return next_state, command


def initial_state(motor_position_m: float) -> AxisState:
    """`at_rest` for an unchecked position (m). Raises ValueError where it is not finite."""
    position_m = float(motor_position_m)
    if not math.isfinite(position_m):
        raise ValueError(f"an axis cannot start at motor position {position_m}")
    return at_rest(position_m)
