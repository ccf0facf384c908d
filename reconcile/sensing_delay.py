"""How late one channel is against another, to a fraction of a sample.

Motor and scale: what stands between them grows with position (lead), turns with the direction (backlash),
goes with the force (compliance) - and, where one is late, with the velocity. All are fitted at once, so that
none is taken for a delay. Command and force: by cross-correlation.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.ndimage import shift, uniform_filter1d
from scipy.signal import correlate, correlation_lags

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

BLOCKS = 8
SMOOTH = 9
"""Samples over which the velocity is taken."""
LONGEST_S = 0.1
ROUNDS = 4
SIGNIFICANT = 5.0
UNSURE_SHARE = 0.04


class Delay(NamedTuple):
    """`late_s` with its standard error: how late the second channel is against the first."""

    first: str
    second: str
    late_s: float
    error_s: float
    gain: float
    """Slope of the second over the first."""

    @property
    def certain(self) -> bool:
        """Whether it is there at all."""
        return abs(self.late_s) > SIGNIFICANT * self.error_s


def scale_delay(motor_m: Array, scale_m: Array, force_n: Array, period_s: float) -> Delay | None:
    """The scale against the motor (n,); None where nothing moves fast enough to tell."""
    velocity_m_s = uniform_filter1d(np.gradient(motor_m, period_s), SMOOTH)
    fast = float(np.percentile(np.abs(velocity_m_s), 95.0))
    if fast <= 0.0:
        return None
    direction = np.tanh(velocity_m_s / (0.02 * fast))
    known = np.column_stack(
        [
            np.ones_like(motor_m),
            motor_m - motor_m.mean(),
            direction,
            uniform_filter1d(force_n, SMOOTH),
            np.gradient(velocity_m_s, period_s),
            # a soft drive train with damping follows the force late
            uniform_filter1d(np.gradient(scale_m - motor_m, period_s), SMOOTH),
            velocity_m_s,
        ]
    )
    known = known / np.maximum(np.abs(known).max(axis=0), 1e-300)
    largest = float(np.abs(velocity_m_s).max())
    late_s, gain = 0.0, 1.0
    estimates: list[float] = []
    for _ in range(ROUNDS):
        # what was found so far is taken out of the motor; its velocity is that of the motor as it is
        earlier_m = _delayed(motor_m, late_s / period_s)
        estimates = _block_slopes(known, scale_m - earlier_m)
        if not estimates:
            return None
        more_s = -float(np.median(estimates)) / largest
        late_s += more_s
        if abs(late_s) > LONGEST_S or abs(more_s) < 1e-3 * period_s:
            break
    gain = 1.0 + float(np.polyfit(motor_m - motor_m.mean(), scale_m - motor_m, 1)[0])
    spread = 1.4826 * float(np.median(np.abs(np.array(estimates) - np.median(estimates)))) / largest
    # of what stands between the two, this share may pass for a delay, however steadily
    unsure_s = UNSURE_SHARE * float(np.std(scale_m - gain * motor_m) / np.std(velocity_m_s))
    error_s = max(spread / math.sqrt(len(estimates)), 1e-3 * period_s, unsure_s)
    return Delay("motor_m", "scale_m", late_s, error_s, gain)


def force_delay(command_n: Array, force_n: Array, period_s: float) -> Delay | None:
    """The measured force against its command (n,); None where the command does not change."""
    first, second = np.diff(command_n), np.diff(force_n)
    if not (np.any(first) and np.any(second)):
        return None
    most = round(LONGEST_S / period_s)
    each = [_correlated(a, b, most) for a, b in _blocks(first, second)]
    late = [value for value in each if value is not None]
    if not late:
        return None
    middle = float(np.median(late))
    spread = 1.4826 * float(np.median(np.abs(np.array(late) - middle)))
    delayed_n = _delayed(command_n, middle)
    gain = float(np.polyfit(delayed_n, force_n, 1)[0])
    error_s = max(spread / math.sqrt(len(late)), 0.02) * period_s
    return Delay("force_command_n", "force_n", middle * period_s, error_s, gain)


def _delayed(values: Array, samples: float) -> Array:
    """The channel later by a fraction of a sample, held at its ends."""
    moved: Array = shift(values, samples, order=3 if samples else 0, mode="nearest")
    return moved


def _block_slopes(known: Array, left_m: Array) -> list[float]:
    """The last coefficient of the fit in each block in which the velocity says something."""
    slopes = []
    for rows in np.array_split(np.arange(len(left_m)), BLOCKS):
        matrix = known[rows]
        if np.std(matrix[:, -1]) < 0.05:
            continue
        scale = np.maximum(np.linalg.norm(matrix, axis=0), 1e-12)
        values, *_ = np.linalg.lstsq(matrix / scale, left_m[rows], rcond=1e-6)
        slopes.append(float(values[-1] / scale[-1]))
    return slopes


def _blocks(first: Array, second: Array) -> list[tuple[Array, Array]]:
    return list(zip(np.array_split(first, BLOCKS), np.array_split(second, BLOCKS), strict=True))


def _correlated(first: Array, second: Array, most: int) -> float | None:
    """Samples by which `second` is late, from the top of a parabola through the correlation."""
    if not (np.any(first) and np.any(second)):
        return None
    likeness = correlate(second, first, mode="full", method="fft")
    lags = correlation_lags(len(second), len(first), mode="full")
    near = np.abs(lags) <= min(most, len(first) // 2)
    likeness, lags = np.abs(likeness[near]), lags[near]
    top = int(np.argmax(likeness))
    if top in {0, len(lags) - 1} or likeness[top] < 0.3 * np.linalg.norm(first) * np.linalg.norm(second):
        return None
    left, middle, right = likeness[top - 1 : top + 2]
    bend = left - 2.0 * middle + right
    return float(lags[top] + (0.5 * (left - right) / bend if bend else 0.0))
