"""Inputs and outputs of one tick of an axis.

They are NamedTuples of plain Python floats, ints and bools, so that numba compiles `axis_tick` once; callers
convert with `float(...)`. SI units throughout, positions at the table; error = set point - actual.
"""

import math
from enum import IntEnum, IntFlag
from typing import NamedTuple

from kernels.jit import kernel


class Output(IntEnum):
    """Which loops are closed here, hence which set point the amplifier receives."""

    FORCE = 0
    """CST: position and velocity loop are closed here."""
    VELOCITY = 1
    """CSV: the amplifier closes the velocity loop."""
    POSITION = 2
    """CSP: the amplifier closes both."""


class Status(IntFlag):
    """What was wrong in a tick; 0: nothing. The fault policy decides about the reaction."""

    OK = 0
    BAD_COMMAND = 1
    """A set point that is not finite."""
    BAD_MOTOR_SAMPLE = 2
    """The motor position is absent or not finite."""
    BAD_SCALE_SAMPLE = 4
    """The scale position is absent or not finite while the position loop uses it."""
    FOLLOWING_ERROR = 8
    """The position error exceeds its limit."""


class AxisSample(NamedTuple):
    """Set points of this cycle and the inputs latched at SYNC; an absent value is NaN."""

    position_command_m: float
    velocity_command_m_s: float
    acceleration_command_m_s2: float
    force_offset_n: float
    """Sent to the amplifier unchanged (60B2h); our force limit does not apply to it."""
    motor_position_m: float
    scale_position_m: float
    """NaN where the axis has no scale."""
    motor_force_n: float
    """Measured current as a force at the table; NaN where it is not measured."""
    velocity_offset_m_s: float = 0.0
    """Added to the output of the position loop, finite: contour control of two axes."""


class AxisCommand(NamedTuple):
    """Set points for the amplifier, one field per object, and values for the recording."""

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
    """Observed disturbance that is part of `force_n`."""
    correction_m: float
    """Added to the motor's set point by screw error, backlash take-up and sampled dual loop."""
    saturated: bool
    """The force or the velocity set point is at its limit."""
    status: int
    """A `Status`, as a plain int."""


BAD_COMMAND = int(Status.BAD_COMMAND)  # plain ints: an IntFlag would compile to another type
BAD_MOTOR_SAMPLE = int(Status.BAD_MOTOR_SAMPLE)
BAD_SCALE_SAMPLE = int(Status.BAD_SCALE_SAMPLE)


@kernel
def sample_status(sample: AxisSample, scale_feedback: bool) -> int:
    """`Status` bits of a sample with values that are absent (NaN) or not finite; 0: none."""
    status = 0
    if not (
        math.isfinite(sample.position_command_m)
        and math.isfinite(sample.velocity_command_m_s)
        and math.isfinite(sample.acceleration_command_m_s2)
        and math.isfinite(sample.force_offset_n)
    ):
        status |= BAD_COMMAND
    if not math.isfinite(sample.motor_position_m):
        status |= BAD_MOTOR_SAMPLE
    if scale_feedback and not math.isfinite(sample.scale_position_m):
        status |= BAD_SCALE_SAMPLE
    return status
