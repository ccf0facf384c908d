"""What an axis is made of: the parameters of the tick, constant from one change of settings to the next.

All are NamedTuples of plain Python floats, ints and bools (and arrays, where tables are), so that numba
compiles `axis_tick` once. `servo_ctrl.config.freeze` makes them. SI units throughout; positions at the table.
"""

from __future__ import annotations

from enum import IntEnum
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


class PositionLoop(NamedTuple):
    """Proportional, integral and derivative position loop."""

    kp_1_s: float
    ki_1_s2: float
    kd: float
    """Velocity per change of the error, m/s per m/s."""
    derivative_blend: float
    """Share of the new value in the low pass of the error's change, 0 < blend <= 1."""
    scale_feedback: bool
    """True: closed on the scale; False: on the motor encoder."""


class FuzzyPd(NamedTuple):
    """Fuzzy-PD position law in place of the PID one; see `fuzzy_pd`."""

    enabled: bool
    fine_m: float
    """e1 > 0: up to it the fuzzy controller is alone."""
    coarse_m: float
    """e2 > e1: from it on the PD law is alone."""
    weight_1_m: float
    """k_e > 0 of the weighting between them."""
    error_1_m: float
    """Ke: the error that is positive big is 1 / Ke."""
    change_s_m: float
    """Kec: likewise for the change of the error."""
    output_m_s: float
    """Ku: velocity of the surface's 1."""
    ki_1_s2: float
    """Integral gain within e1."""
    surface: NDArray[np.float64]
    """(n, n), n >= 2, C-contiguous: output over error and change, both on [-1, 1]."""


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


class ScrewError(NamedTuple):
    """Table of the screw's errors; see `compensation.screw_error`."""

    enabled: bool
    table: NDArray[np.float64]
    """(2, n), n >= 1, C-contiguous: table positions m, rising; error there m."""


class BacklashTakeUp(NamedTuple):
    """Lost motion taken up by the motor; see `compensation.backlash`."""

    enabled: bool
    lost_motion_m: float
    acceleration_m_s2: float
    jerk_m_s3: float


class SampledDualLoop(NamedTuple):
    """The scale read at the end point; see `sampled_dual_loop`."""

    enabled: bool
    settle_s: float
    """Rest of the command, and of the last correction, before the scale is read."""
    tolerance_m: float
    corrections: int
    """So many at one end point, at most."""
    limit_m: float
    """Bound of the correction."""
    smooth: bool
    """Corrections by a five-phase S curve; else trapezoidal."""
    acceleration_m_s2: float
    jerk_m_s3: float


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
    fuzzy: FuzzyPd
    velocity_loop: VelocityLoop
    feedforward: Feedforward
    pulse: FrictionPulse
    observer: DisturbanceObserver
    screw: ScrewError
    take_up: BacklashTakeUp
    sampled: SampledDualLoop
    limits: AxisLimits
