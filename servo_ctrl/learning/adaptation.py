"""Adapts the learned pulse from production reversals, without strokes (not in the paper; off by default).

The mean error during the pulse measures the amplitude error: the pulse was too small if the table lags, too
large if it leads. Each reversal moves the amplitudes at the nearest learned accelerations by a small share
of it, and those of the second trapezoid in proportion; durations are kept. This follows slow changes. After a
jump, or where the shape of the error changes, learning with strokes achieves more.
"""

import numpy as np

from servo_ctrl.learning.amplitudes import smallest_amplitude_m_s
from servo_ctrl.learning.pulse_functions import amplitudes_m_s, pulse_at
from servo_ctrl.learning.stroke_result import first_samples
from servo_ctrl.learning.types import Learned, LearningSettings, StrokeResult

GAIN = 0.5
"""Relative change of the amplitude per mean error over the travel of the pulse; calibrated in the twin."""
MAX_RELATIVE_STEP = 0.03
"""Bounds the relative change of an amplitude by one reversal; chosen."""
INFLUENCE_RATIO = 1.6
"""Ratio of accelerations beyond which a reversal does not change an amplitude; chosen."""
DEAD_BAND_SHARE = 0.25
"""Mean error that counts as noise, as a share of J after learning; chosen."""


def adapted(
    learned: Learned, settings: LearningSettings, acceleration_m_s2: float, result: StrokeResult
) -> Learned | None:
    """Return the functions after one more reversal; None if it changes nothing.

    A reversal outside the learned accelerations changes nothing: it gives no information on those inside.
    """
    a_min, *_, a_max = settings.accelerations_m_s2
    if not a_min <= acceleration_m_s2 <= a_max:
        return None
    pulse = pulse_at(learned, acceleration_m_s2)
    travel_m = pulse.amplitude_m_s * max(pulse.duration_s - settings.rise_s, settings.rise_s)
    mean_lag_m = float(np.mean(first_samples(result, pulse.duration_s)))
    if not np.isfinite(mean_lag_m) or abs(mean_lag_m) <= DEAD_BAND_SHARE * learned.after_m:
        return None
    step = float(np.clip(GAIN * mean_lag_m / travel_m, -MAX_RELATIVE_STEP, MAX_RELATIVE_STEP))
    lowest, highest = smallest_amplitude_m_s(settings), settings.amplitude_max_m_s
    amplitudes = []
    for a, amplitude_m_s in learned.amplitudes:
        weight = max(0.0, 1.0 - abs(float(np.log(a / acceleration_m_s2) / np.log(INFLUENCE_RATIO))))
        changed_m_s = amplitude_m_s * (1.0 + step * weight)
        amplitudes.append((a, min(max(changed_m_s, lowest), highest)))
    if tuple(amplitudes) == learned.amplitudes:
        return None
    return _with_trailing_in_proportion(learned, learned._replace(amplitudes=tuple(amplitudes)), highest)


def _with_trailing_in_proportion(before: Learned, after: Learned, highest_m_s: float) -> Learned:
    """Scale the second trapezoid of `after` by the ratio of the pulse amplitudes after and before."""
    if not before.trailing:
        return after
    at = np.array([point[0] for point in before.trailing])
    ratios = amplitudes_m_s(after, at) / amplitudes_m_s(before, at)
    trailing = []
    for (a, start_s, duration_s, amplitude_m_s), ratio in zip(before.trailing, ratios.tolist(), strict=True):
        changed_m_s = min(max(amplitude_m_s * ratio, -highest_m_s), highest_m_s)
        trailing.append((a, start_s, duration_s, changed_m_s))
    return after._replace(trailing=tuple(trailing))
