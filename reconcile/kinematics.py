"""How an axis moved, as its own sensors tell: velocity, direction, standstill, distance since the reversal.

The velocity is of zero phase: these are coordinates that effects live in, seen afterwards.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numba
import numpy as np
from scipy.ndimage import gaussian_filter1d

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

CORNERS_HZ = (200.0, 150.0, 110.0, 80.0, 60.0, 45.0)
"""Of the velocity's low pass: the highest at which the acceleration is not made of noise."""
NOISE_SHARE = 0.05
"""Of the acceleration's RMS."""
REST_S = 0.03
"""Shorter is a reversal, not a rest."""


class Kinematics(NamedTuple):
    """All (n,), at the samples of the recording."""

    corner_hz: float
    """Of the low pass that velocity and acceleration come from."""
    position_m: Array
    velocity_m_s: Array
    acceleration_m_s2: Array
    creep_m_s: float
    """Below it the velocity is noise."""
    direction: Array
    """Sign of the motion; where there is none, that of the last one, until the force says more."""
    last_direction: Array
    """Of the last motion, +1 or -1, that goes on through a rest; 0 before the first."""
    since_reversal_m: Array
    """Way since the motion last turned."""
    dwell_s: Array
    """How long the axis had stood before the present motion began; 0 where it did not stand."""
    since_rest_m: Array
    """Way since it stood."""
    moving: NDArray[np.bool_]
    """Faster than it creeps."""
    resting: NDArray[np.bool_]
    """Standing for `REST_S` around."""


def kinematics(position_m: Array, period_s: float) -> Kinematics:
    """From the motor's positions (n,), n > 50."""
    count_m, noise_m = _count(position_m), _noise(position_m)
    corner_hz = _corner_hz(position_m, period_s, max(noise_m, 0.3 * count_m))
    smooth_m = _smoothed(position_m, bell_s(corner_hz) / period_s)
    velocity_m_s = np.gradient(smooth_m, period_s)
    # the noise that the low pass keeps of the slope; four times that, and two counts, are no motion
    passed = math.sqrt(corner_hz * 2.0 * period_s) * 2.0 * math.pi * corner_hz / math.sqrt(3.0)
    fastest_m_s = float(np.abs(velocity_m_s).max())
    creep_m_s = max(4.0 * noise_m * passed, count_m * corner_hz, 1e-4 * fastest_m_s, 1e-9)
    moving = np.abs(velocity_m_s) > creep_m_s
    last, since_m, dwell_s, since_rest_m = _history(smooth_m, velocity_m_s, moving, period_s)
    half = max(round(REST_S / period_s), 1)
    still = np.convolve(~moving, np.ones(2 * half + 1), mode="same") >= 2 * half
    return Kinematics(
        corner_hz,
        position_m,
        velocity_m_s,
        np.gradient(velocity_m_s, period_s),
        creep_m_s,
        np.where(moving, np.sign(velocity_m_s), last),
        last,
        since_m,
        dwell_s,
        since_rest_m,
        moving,
        still,
    )


def _corner_hz(position_m: Array, period_s: float, noise_m: float) -> float:
    """The corner for positions with so much noise, at most 0.6 of the Nyquist frequency."""
    corners_hz = [corner for corner in CORNERS_HZ if corner <= 0.3 / period_s] or [0.3 / period_s]
    slowest_hz = corners_hz[-1]
    smooth_m = _smoothed(position_m, bell_s(slowest_hz) / period_s)
    rms_m_s2 = float(np.std(np.gradient(np.gradient(smooth_m, period_s), period_s)))
    for corner_hz in corners_hz:
        w = 2.0 * math.pi * corner_hz
        passed_m_s2 = noise_m * w**2 * math.sqrt(corner_hz * 2.0 * period_s / 5.0)  # of white noise
        if passed_m_s2 <= NOISE_SHARE * rms_m_s2:
            return corner_hz
    return slowest_hz


def bell_s(corner_hz: float) -> float:
    """Of a bell of half the height at the corner: it does not overshoot, so no motion is turned round."""
    return math.sqrt(2.0 * math.log(2.0)) / (2.0 * math.pi * corner_hz)


def _smoothed(position_m: Array, width: float) -> Array:
    """By a bell of so many samples; beyond its ends the axis goes on as it did."""
    margin = min(math.ceil(5.0 * width), len(position_m) - 1)
    longer_m = np.pad(position_m, margin, mode="reflect", reflect_type="odd")
    smooth_m: Array = gaussian_filter1d(longer_m, width)[margin : margin + len(position_m)]
    return smooth_m


@numba.njit(cache=True)
def bristles(position_m: Array, way_m: float, exponent: float = 1.0) -> Array:
    """Dahl's deflection, -1 to 1, exact over each sample's step: dz/dx = (1 - z sign(dx))^exponent / way."""
    z = np.zeros(len(position_m))
    for i in range(1, len(position_m)):
        step_m = position_m[i] - position_m[i - 1]
        towards = 1.0 if step_m > 0.0 else -1.0
        left = 1.0 - z[i - 1] * towards
        if exponent == 1.0:
            left *= np.exp(-abs(step_m) / way_m)
        elif left > 0.0:
            power = 1.0 - exponent
            rest = left**power - power * abs(step_m) / way_m
            left = rest ** (1.0 / power) if rest > 0.0 else 0.0
        z[i] = towards * (1.0 - left)
    return z


def _noise(position_m: Array) -> float:
    """RMS of white noise: its third difference has a variance of 20."""
    return 1.4826 * float(np.median(np.abs(np.diff(position_m, 3)))) / math.sqrt(20.0)


def _count(position_m: Array) -> float:
    """The smallest step that occurs, 0 where nothing moves."""
    steps_m = np.abs(np.diff(position_m))
    smallest_m = float(steps_m[steps_m > 0.0].min(initial=math.inf))
    return smallest_m if math.isfinite(smallest_m) else 0.0


@numba.njit(cache=True)
def _history(
    position_m: Array, velocity_m_s: Array, moving: NDArray[np.bool_], period_s: float
) -> tuple[Array, Array, Array, Array]:
    n = len(position_m)
    last, since_m = np.zeros(n), np.zeros(n)
    dwell_s, since_rest_m = np.zeros(n), np.zeros(n)
    direction, turned_m, started_m = 0.0, position_m[0], position_m[0]
    stood_s, before_s = 0.0, 0.0
    for i in range(n):
        if moving[i]:
            sign = 1.0 if velocity_m_s[i] > 0.0 else -1.0
            if stood_s > 0.0:
                started_m, before_s = position_m[i], stood_s
            if sign != direction:
                direction, turned_m = sign, position_m[i]
                if stood_s == 0.0:
                    started_m, before_s = position_m[i], 0.0
            stood_s = 0.0
        else:
            stood_s += period_s
        last[i], since_m[i] = direction, abs(position_m[i] - turned_m)
        dwell_s[i], since_rest_m[i] = before_s, abs(position_m[i] - started_m)
    return last, since_m, dwell_s, since_rest_m
