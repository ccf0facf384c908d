"""The values that pass through one tick of an axis.

All are NamedTuples of plain Python floats, ints and bools, so that numba compiles `axis_tick` once; whoever
builds samples coerces with `float(...)`. The parameters are in `control.params`.
SI units throughout; positions at the table; error = set point - actual.
"""

from __future__ import annotations

import math
from enum import IntFlag
from typing import NamedTuple


class Status(IntFlag):
    """What was wrong in a tick; 0 is a good one. The fault policy decides what to do about it."""

    OK = 0
    BAD_COMMAND = 1
    """A set point that is not finite."""
    BAD_MOTOR_SAMPLE = 2
    """The motor position is absent or not finite."""
    BAD_SCALE_SAMPLE = 4
    """The scale position, which closes the loop, is absent or not finite."""
    FOLLOWING_ERROR = 8
    """The position error exceeds its limit."""


class PulseShape(NamedTuple):
    """One friction compensation pulse."""

    duration_s: float
    """T."""
    amplitude_m_s: float
    """A, in the new direction."""
    trailing_start_s: float
    """From the reversal to the second trapezoid."""
    trailing_duration_s: float
    trailing_amplitude_m_s: float
    """Of either sign; 0 without a second trapezoid."""


class PulseState(NamedTuple):
    """Where the pulse is."""

    position_command_m: float
    """Of the last sample."""
    direction: float
    """Of the last motion, +1 or -1; 0 before the first."""
    age_s: float
    """Since the last reversal."""
    shape: PulseShape
    """Of the pulse that began there."""


class ObserverState(NamedTuple):
    """Where the observer is."""

    disturbance_n: float
    velocity_m_s: float
    """Of the last sample; NaN after a bad one."""
    motor_force_n: float
    """Of the last sample; NaN before the first, and where it must not be used."""


class PositionState(NamedTuple):
    """Where the position loop is."""

    error_m: float
    """Of the last sample."""
    change_m_s: float
    """Filtered change of the error."""
    integral_m_s: float


class OffsetMotion(NamedTuple):
    """A shift of the motor's set point on its way; see `offset_motion`."""

    from_m: float
    to_m: float
    elapsed_s: float
    duration_s: float
    smooth: bool


class SampledState(NamedTuple):
    """Where the sampled dual loop is."""

    rest_s: float
    """Since command and correction came to rest."""
    corrections: int
    """Made at this end point, or all of them once it is within the tolerance."""
    motion: OffsetMotion


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
    position_loop: PositionState
    pulse: PulseState
    observer: ObserverState
    screw_error_m: float
    """At the last position command, by the table of that tick."""
    take_up: OffsetMotion
    sampled: SampledState


class AxisSample(NamedTuple):
    """What the tick is given: set points of this cycle and the latched inputs; absent = NaN."""

    position_command_m: float
    velocity_command_m_s: float
    acceleration_command_m_s2: float
    force_offset_n: float
    """Goes to the amplifier unchanged, behind our force limit (60B2h)."""
    motor_position_m: float
    scale_position_m: float
    """NaN where the axis has no scale."""
    motor_force_n: float
    """Measured current as a force at the table; NaN where it is not measured."""


class AxisCommand(NamedTuple):
    """What the tick gives: one field per set point object, and what the recording wants to know."""

    position_m: float
    """The position command; 607Ah in CSP, where the correction is added."""
    velocity_m_s: float
    """60FFh in CSV: output of the position loop with feedforward, limited."""
    force_n: float
    """6071h in CST, limited; 0 in CSV and CSP."""
    force_offset_n: float
    """60B2h: the sample's offset; in CSV and CSP plus the acceleration feedforward."""
    position_error_m: float
    """Position command - feedback of the position loop; NaN after a bad sample."""
    motor_velocity_m_s: float
    """The estimate that the velocity loop uses."""
    pulse_m_s: float
    """Friction compensation in `velocity_m_s`."""
    disturbance_n: float
    """What the observer has added to `force_n`."""
    correction_m: float
    """Screw error, backlash take-up and sampled dual loop: the motor is led to the command plus this."""
    saturated: bool
    """The force or the velocity set point is at its limit."""
    status: int
    """A `Status`, as a plain int."""


def initial_state(motor_position_m: float) -> AxisState:
    """An axis at rest at `motor_position_m` (metres), with nothing in its integrators."""
    position = float(motor_position_m)
    if not math.isfinite(position):
        raise ValueError(f"an axis cannot start at motor position {position}")
    resting = OffsetMotion(0.0, 0.0, 0.0, 0.0, True)
    return AxisState(
        position,
        position,
        0.0,
        0.0,
        0.0,
        0.0,
        PositionState(0.0, 0.0, 0.0),
        PulseState(position, 0.0, 0.0, PulseShape(0.0, 0.0, 0.0, 0.0, 0.0)),
        ObserverState(0.0, 0.0, math.nan),
        0.0,
        resting,
        SampledState(0.0, 0, resting),
    )
