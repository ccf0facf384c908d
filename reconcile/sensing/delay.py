"""Estimates the delay of one channel against another, to a fraction of a sample.

Motor and scale: their difference depends on position (lead), direction (backlash), force (compliance) and,
with a delay, on velocity. All are fitted together, so that none is mistaken for a delay. For command and
force it uses cross-correlation.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.ndimage import shift, uniform_filter1d
from scipy.signal import correlate, correlation_lags

from kernels.arrays import Array

BLOCKS = 8
"""Number of blocks with an estimate each; their scatter gives the standard error."""
VELOCITY_SAMPLES = 9
"""Moving average of the velocity, samples."""
LONGEST_DELAY_S = 0.1
"""Bounds the searched delays, s."""
MOST_ITERATIONS = 4
LEAST_STANDARD_ERRORS = 5.0
"""Significance of a reported delay."""
UNCERTAIN_SHARE = 0.04
"""Share of the difference between motor and scale that may look like a delay: bounds the error from below."""


class Delay(NamedTuple):
    """Delay `late_s` of the second channel relative to the first, with its standard error."""

    first: str
    second: str
    late_s: float
    error_s: float
    gain: float
    """Slope of the second channel over the first."""

    @property
    def certain(self) -> bool:
        """Whether the delay is significant."""
        return abs(self.late_s) > LEAST_STANDARD_ERRORS * self.error_s


def scale_delay(motor_m: Array, scale_m: Array, force_n: Array, period_s: float) -> Delay | None:
    """Return the delay of the scale relative to the motor (n,); None where the axis is too slow."""
    velocity_m_s = uniform_filter1d(np.gradient(motor_m, period_s), VELOCITY_SAMPLES)
    fast = float(np.percentile(np.abs(velocity_m_s), 95.0))
    if fast <= 0.0:
        return None
    direction = np.tanh(velocity_m_s / (0.02 * fast))
    columns = np.column_stack(
        [
            np.ones_like(motor_m),
            motor_m - motor_m.mean(),
            direction,
            uniform_filter1d(force_n, VELOCITY_SAMPLES),
            np.gradient(velocity_m_s, period_s),
            # a compliant drive train with damping lags the force
            uniform_filter1d(np.gradient(scale_m - motor_m, period_s), VELOCITY_SAMPLES),
            velocity_m_s,
        ]
    )
    columns = columns / np.maximum(np.abs(columns).max(axis=0), 1e-300)
    largest = float(np.abs(velocity_m_s).max())
    late_s, estimates = 0.0, list[float]()
    for _ in range(MOST_ITERATIONS):
        # the motor is shifted by the delay found so far; the velocity column stays that of the motor
        earlier_m = _delayed(motor_m, late_s / period_s)
        estimates = _block_slopes(columns, scale_m - earlier_m)
        if not estimates:
            return None
        correction_s = -float(np.median(estimates)) / largest
        late_s += correction_s
        if abs(late_s) > LONGEST_DELAY_S or abs(correction_s) < 1e-3 * period_s:
            break
    gain = 1.0 + float(np.polyfit(motor_m - motor_m.mean(), scale_m - motor_m, 1)[0])
    spread = 1.4826 * float(np.median(np.abs(np.array(estimates) - np.median(estimates)))) / largest
    # a systematic error, which the scatter of the blocks does not show
    uncertain_s = UNCERTAIN_SHARE * float(np.std(scale_m - gain * motor_m) / np.std(velocity_m_s))
    error_s = max(spread / math.sqrt(len(estimates)), 1e-3 * period_s, uncertain_s)
    return Delay("motor_m", "scale_m", late_s, error_s, gain)


def force_delay(command_n: Array, force_n: Array, period_s: float) -> Delay | None:
    """Return the delay of the measured force relative to its command (n,); None for a constant command."""
    first, second = np.diff(command_n), np.diff(force_n)
    if not (np.any(first) and np.any(second)):
        return None
    most_samples = round(LONGEST_DELAY_S / period_s)
    blocks = zip(np.array_split(first, BLOCKS), np.array_split(second, BLOCKS), strict=True)
    delays = [late for block in blocks if (late := _correlated(*block, most_samples)) is not None]
    if not delays:
        return None
    middle = float(np.median(delays))
    spread = 1.4826 * float(np.median(np.abs(np.array(delays) - middle)))
    delayed_n = _delayed(command_n, middle)
    gain = float(np.polyfit(delayed_n, force_n, 1)[0])
    error_s = max(spread / math.sqrt(len(delays)), 0.02) * period_s
    return Delay("force_command_n", "force_n", middle * period_s, error_s, gain)


def _delayed(values: Array, samples: float) -> Array:
    """Delay a channel (n,) by a fraction of a sample; constant at its ends."""
    moved: Array = shift(values, samples, order=3 if samples else 0, mode="nearest")
    return moved


def _block_slopes(columns: Array, deviation_m: Array) -> list[float]:
    """Return the coefficient of the last column, the velocity, in each block in which it varies."""
    slopes = []
    for rows in np.array_split(np.arange(len(deviation_m)), BLOCKS):
        matrix = columns[rows]
        if np.std(matrix[:, -1]) < 0.05:
            continue
        scale = np.maximum(np.linalg.norm(matrix, axis=0), 1e-12)
        values, *_ = np.linalg.lstsq(matrix / scale, deviation_m[rows], rcond=1e-6)
        slopes.append(float(values[-1] / scale[-1]))
    return slopes


def _correlated(first: Array, second: Array, most_samples: int) -> float | None:
    """Return the delay of `second` in samples, from the vertex of a parabola through the correlation peak."""
    if not (np.any(first) and np.any(second)):
        return None
    correlation = correlate(second, first, mode="full", method="fft")
    lags = correlation_lags(len(second), len(first), mode="full")
    within = np.abs(lags) <= min(most_samples, len(first) // 2)
    correlation, lags = np.abs(correlation[within]), lags[within]
    peak = int(np.argmax(correlation))
    if peak in {0, len(lags) - 1} or correlation[peak] < 0.3 * np.linalg.norm(first) * np.linalg.norm(second):
        return None
    left, middle, right = correlation[peak - 1 : peak + 2]
    bend = left - 2.0 * middle + right
    return float(lags[peak] + (0.5 * (left - right) / bend if bend else 0.0))
