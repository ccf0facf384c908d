"""The values that pass through one tick of an axis.

All are NamedTuples of plain Python floats, ints and bools, so that numba compiles `axis_tick` once.
`servo_ctrl.config.freeze` makes the parameters; whoever builds samples coerces with `float(...)`.
SI units throughout; positions at the table; error = set point - actual.
"""

from __future__ import annotations

import math
from enum import IntEnum, IntFlag
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class Output(IntEnum):
    """Which loop is closed here, hence which set point the amplifier gets."""

    FORCE = 0
    """CST: position and velocity loop are closed here."""
    VELOCITY = 1
    """CSV: the amplifier closes the velocity loop."""
    POSITION = 2
    """CSP: the amplifier closes both."""


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


class PositionLoop(NamedTuple):
    """Proportional position loop."""

    kp_1_s: float
    scale_feedback: bool
    """True: closed on the scale; False: on the motor encoder."""


class VelocityLoop(NamedTuple):
    """Proportional-integral velocity loop on the motor's velocity."""

    kv_n_s_m: float
    ki_n_m: float
    window_samples: int
    """1 or 2: velocity is (q[k] - q[k-n]) / (n T)."""
    filter_blend: float
    """Share of the new value in the first-order low pass, 0 < blend <= 1; 1 = no filter."""


class Feedforward(NamedTuple):
    """What is known in advance."""

    velocity: float
    """Share of the velocity command, 1 = all of it."""
    acceleration_kg: float
    """Moved mass."""


class FrictionPulse(NamedTuple):
    """Trapezoidal pulse at the reversals; see `compensation.trapezoidal_pulse`."""

    enabled: bool
    rise_s: float
    """Rise time Tr, > 0."""
    amplitude_max_m_s: float
    """A_max: whatever was learned, the pulse stays below."""
    learned: NDArray[np.float64]
    """(6, n), n >= 1, C-contiguous: reverse accelerations m/s^2, rising; then the fields of `PulseShape`."""


class DisturbanceObserver(NamedTuple):
    """Nominal model and low pass; see `disturbance_observer`."""

    enabled: bool
    mass_kg: float
    viscous_n_s_m: float
    filter_blend: float
    """Share of the new value in the first-order low pass, 0 < blend <= 1."""


class AxisLimits(NamedTuple):
    """Bounds of the commands and of the position error, all positive."""

    velocity_m_s: float
    force_n: float
    following_error_m: float


class AxisParams(NamedTuple):
    """Everything `axis_tick` knows about an axis."""

    period_s: float
    output: int
    """An `Output`, as a plain int."""
    position_loop: PositionLoop
    velocity_loop: VelocityLoop
    feedforward: Feedforward
    pulse: FrictionPulse
    observer: DisturbanceObserver
    limits: AxisLimits


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
    pulse: PulseState
    observer: ObserverState


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
    """607Ah in CSP."""
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
    saturated: bool
    """The force or the velocity set point is at its limit."""
    status: int
    """A `Status`, as a plain int."""


def initial_state(motor_position_m: float) -> AxisState:
    """An axis at rest at `motor_position_m` (metres), with nothing in its integrator."""
    position = float(motor_position_m)
    if not math.isfinite(position):
        raise ValueError(f"an axis cannot start at motor position {position}")
    pulse = PulseState(position, 0.0, 0.0, PulseShape(0.0, 0.0, 0.0, 0.0, 0.0))
    observer = ObserverState(0.0, 0.0, math.nan)
    return AxisState(position, position, 0.0, 0.0, 0.0, 0.0, pulse, observer)
