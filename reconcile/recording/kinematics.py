"""Kinematics of a recorded axis: velocity, acceleration, direction, standstill, distance since the reversal.

Velocity and acceleration have zero phase, because they are coordinates of effects and computed afterwards.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from hil_sim.physics.friction.presliding_elements import deflection_after
from kernels.arrays import Array
from kernels.jit import kernel

LOW_PASS_CORNERS_HZ = (200.0, 150.0, 110.0, 80.0, 60.0, 45.0)
"""Corners of the low pass of the position; the highest with small noise of the acceleration is used."""
LARGEST_NOISE_SHARE = 0.05
"""Largest noise of the acceleration, as a share of its RMS; or of its force, as a share of the force."""
UPPER_QUARTILE = 0.75
QUARTILE_OF_ROUNDING = 1.15 / math.sqrt(12.0)
"""Upper quartile of the size of a normal variable with the variance of rounding to whole counts, counts."""
SHORTEST_STANDSTILL_S = 0.03
"""Least duration of a standstill, s; shorter stops are reversals."""


class Kinematics(NamedTuple):
    """Arrays (n,), at the samples of the recording."""

    corner_hz: float
    """Corner of the low pass of velocity and acceleration."""
    position_m: Array
    velocity_m_s: Array
    acceleration_m_s2: Array
    velocity_threshold_m_s: float
    """Largest speed that is indistinguishable from noise."""
    direction: Array
    """Sign of the velocity; at standstill that of the last motion, or the share of friction."""
    last_direction: Array
    """Sign of the last motion, also at standstill; 0 before the first."""
    distance_since_reversal_m: Array
    """Distance since the direction of motion last changed."""
    dwell_s: Array
    """Duration of the standstill before the present motion; 0 after a reversal without one."""
    distance_since_standstill_m: Array
    """Distance since the present motion began."""
    moving: NDArray[np.bool_]
    """Faster than `velocity_threshold_m_s`."""
    standing_still: NDArray[np.bool_]
    """At standstill for `SHORTEST_STANDSTILL_S` around the sample."""


def kinematics(position_m: Array, period_s: float, most_hz: float = math.inf) -> Kinematics:
    """Compute the kinematics of motor positions (n,), n > 50, filtered by a low pass of at most `most_hz`."""
    count_m, noise_m = _resolution_m(position_m), _noise_m(position_m)
    corner_hz = min(finest_corner_hz(position_m, period_s), most_hz)
    smooth_m = smoothed_position(position_m, period_s, corner_hz)
    velocity_m_s = np.gradient(smooth_m, period_s)
    # threshold: four times the velocity noise behind the low pass, or one count in the time of its corner
    passed_rad_s = math.sqrt(corner_hz * 2.0 * period_s) * 2.0 * math.pi * corner_hz / math.sqrt(3.0)
    fastest_m_s = float(np.abs(velocity_m_s).max())
    velocity_threshold_m_s = max(4.0 * noise_m * passed_rad_s, count_m * corner_hz, 1e-4 * fastest_m_s, 1e-9)
    moving = np.abs(velocity_m_s) > velocity_threshold_m_s
    last_direction, since_reversal_m, dwell_s, distance_since_standstill_m = _history(
        smooth_m, velocity_m_s, moving, period_s
    )
    half_window = max(round(SHORTEST_STANDSTILL_S / period_s), 1)
    standing_still = np.convolve(~moving, np.ones(2 * half_window + 1), mode="same") >= 2 * half_window
    return Kinematics(
        corner_hz=corner_hz,
        position_m=position_m,
        velocity_m_s=velocity_m_s,
        acceleration_m_s2=np.gradient(velocity_m_s, period_s),
        velocity_threshold_m_s=velocity_threshold_m_s,
        direction=np.where(moving, np.sign(velocity_m_s), last_direction),
        last_direction=last_direction,
        distance_since_reversal_m=since_reversal_m,
        dwell_s=dwell_s,
        distance_since_standstill_m=distance_since_standstill_m,
        moving=moving,
        standing_still=standing_still,
    )


def acceleration_noise_m_s2(position_m: Array, period_s: float, corner_hz: float) -> float:
    """Return the RMS noise of the acceleration behind a low pass: that of white noise, or of rounding."""
    return _position_noise_m(position_m) * _double_differentiator_1_s2(period_s, corner_hz)


def _position_noise_m(position_m: Array) -> float:
    return max(_noise_m(position_m), 0.3 * _resolution_m(position_m))


def _double_differentiator_1_s2(period_s: float, corner_hz: float) -> float:
    """Return the RMS gain of white noise by two derivatives behind a low pass."""
    return (2.0 * math.pi * corner_hz) ** 2 * math.sqrt(corner_hz * 2.0 * period_s / 5.0)


def finest_corner_hz(position_m: Array, period_s: float) -> float:
    """Return the corner of the low pass, at most 0.6 of the Nyquist frequency."""
    corners_hz = [corner for corner in LOW_PASS_CORNERS_HZ if corner <= 0.3 / period_s] or [0.3 / period_s]
    slowest_hz = corners_hz[-1]
    smooth_m = smoothed_position(position_m, period_s, slowest_hz)
    rms_m_s2 = float(np.std(np.gradient(np.gradient(smooth_m, period_s), period_s)))
    noise_m = _position_noise_m(position_m)
    for corner_hz in corners_hz:
        if noise_m * _double_differentiator_1_s2(period_s, corner_hz) <= LARGEST_NOISE_SHARE * rms_m_s2:
            return corner_hz
    return slowest_hz


def gaussian_width_s(corner_hz: float) -> float:
    """Return the standard deviation (s) of the Gaussian with gain 1/2 at the corner; it has no overshoot."""
    return math.sqrt(2.0 * math.log(2.0)) / (2.0 * math.pi * corner_hz)


def smoothed_position(position_m: Array, period_s: float, corner_hz: float) -> Array:
    """Return the low-passed position (n,); a motion goes on beyond its ends, by odd reflection."""
    width = gaussian_width_s(corner_hz) / period_s
    margin = min(math.ceil(5.0 * width), len(position_m) - 1)
    extended_m = np.pad(position_m, margin, mode="reflect", reflect_type="odd")
    smooth_m: Array = gaussian_filter1d(extended_m, width)[margin : margin + len(position_m)]
    return smooth_m


@kernel
def dahl_deflection(position_m: Array, deflection_m: float, exponent: float = 1.0) -> Array:
    """Return Dahl's deflection (n,), -1 to 1, exact: dz/dx = (1 - z sign(dx))^exponent / deflection_m."""
    z = np.zeros(len(position_m))
    for i in range(1, len(position_m)):
        z[i] = deflection_after(z[i - 1], position_m[i] - position_m[i - 1], deflection_m, exponent)
    return z


def _noise_m(position_m: Array) -> float:
    """Return the RMS of white noise, from the third difference (variance 20)."""
    return 1.4826 * float(np.median(np.abs(np.diff(position_m, 3)))) / math.sqrt(20.0)


def _resolution_m(position_m: Array) -> float:
    """Return the smallest step between two samples, at most what the moving samples allow; 0 without motion.

    An axis that starts abruptly passes hundreds of counts in its first sample: its smallest step is no count,
    but its third differences are those of rounding.
    """
    steps_m = np.abs(np.diff(position_m))
    moved = steps_m > 0.0
    third_m = np.abs(np.diff(position_m, 3))[moved[1:-1]]
    if not len(third_m):
        return float(steps_m.max())
    most_m = float(np.quantile(third_m, UPPER_QUARTILE)) / (QUARTILE_OF_ROUNDING * math.sqrt(20.0))
    return min(float(steps_m[moved].min()), most_m)


@kernel
def _history(
    position_m: Array, velocity_m_s: Array, moving: NDArray[np.bool_], period_s: float
) -> tuple[Array, Array, Array, Array]:
    n = len(position_m)
    last_direction, since_reversal_m = np.zeros(n), np.zeros(n)
    dwell_s, distance_since_standstill_m = np.zeros(n), np.zeros(n)
    direction, reversed_at_m, started_at_m = 0.0, position_m[0], position_m[0]
    stood_s, last_stop_s = 0.0, 0.0
    for i in range(n):
        if moving[i]:
            sign = 1.0 if velocity_m_s[i] > 0.0 else -1.0
            if stood_s > 0.0:
                started_at_m, last_stop_s = position_m[i], stood_s
            if sign != direction:
                direction, reversed_at_m = sign, position_m[i]
                if stood_s == 0.0:
                    started_at_m, last_stop_s = position_m[i], 0.0
            stood_s = 0.0
        else:
            stood_s += period_s
        last_direction[i], since_reversal_m[i] = direction, abs(position_m[i] - reversed_at_m)
        dwell_s[i], distance_since_standstill_m[i] = last_stop_s, abs(position_m[i] - started_at_m)
    return last_direction, since_reversal_m, dwell_s, distance_since_standstill_m
