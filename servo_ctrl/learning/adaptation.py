"""Learning from production reversals, without strokes of its own (ours; off by default).

The error that is left after a reversal says what the amplitude should have been: where the table lags over
the pulse it was too small, where it runs ahead too large. The amplitudes at the nearest learned accelerations
move by a small share of that, those of the second trapezoid in proportion, and all times stay. It follows
slow changes; after a jump, or where the shape of the error changes, learning with strokes finds more.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from servo_ctrl.learning.amplitudes import smallest_amplitude_m_s
from servo_ctrl.learning.pulse_functions import amplitudes_m_s, pulse_at
from servo_ctrl.learning.stroke_result import first_samples

if TYPE_CHECKING:
    from servo_ctrl.learning.types import Learned, LearningSettings, StrokeResult

GAIN = 0.5
"""Relative change of the amplitude per error, in units of the way that the pulse makes."""
LARGEST_STEP = 0.03
"""Share of the amplitude that one reversal may change."""
REACH = 1.6
"""Ratio of accelerations over which a reversal is heard."""
LEFT_BEHIND = 0.25
"""Of the J that learning left: a mean error below it is not held against the pulse."""


def adapted(
    learned: Learned, settings: LearningSettings, acceleration_m_s2: float, result: StrokeResult
) -> Learned | None:
    """The functions after one more reversal; None when it says nothing.

    Reversals outside the learned accelerations say nothing about the functions inside.
    """
    a_min, *_, a_max = settings.accelerations_m_s2
    if not a_min <= acceleration_m_s2 <= a_max:
        return None
    pulse = pulse_at(learned, acceleration_m_s2)
    way_m = pulse.amplitude_m_s * max(pulse.duration_s - settings.rise_s, settings.rise_s)
    lag_m = float(np.mean(first_samples(result, pulse.duration_s)))
    if not np.isfinite(lag_m) or abs(lag_m) <= LEFT_BEHIND * learned.after_m:
        return None
    step = float(np.clip(GAIN * lag_m / way_m, -LARGEST_STEP, LARGEST_STEP))
    lowest, highest = smallest_amplitude_m_s(settings), settings.amplitude_max_m_s
    amplitudes = []
    for a, amplitude_m_s in learned.amplitudes:
        nearness = max(0.0, 1.0 - abs(float(np.log(a / acceleration_m_s2) / np.log(REACH))))
        changed_m_s = amplitude_m_s * (1.0 + step * nearness)
        amplitudes.append((a, min(max(changed_m_s, lowest), highest)))
    if tuple(amplitudes) == learned.amplitudes:
        return None
    return _with_trailing_in_proportion(learned, learned._replace(amplitudes=tuple(amplitudes)), highest)


def _with_trailing_in_proportion(before: Learned, after: Learned, highest_m_s: float) -> Learned:
    """`after` with the second trapezoid as much larger than `before` as the pulse at its place."""
    if not before.trailing:
        return after
    at = np.array([point[0] for point in before.trailing])
    ratios = amplitudes_m_s(after, at) / amplitudes_m_s(before, at)
    trailing = []
    for (a, start_s, duration_s, amplitude_m_s), ratio in zip(before.trailing, ratios.tolist(), strict=True):
        changed_m_s = min(max(amplitude_m_s * ratio, -highest_m_s), highest_m_s)
        trailing.append((a, start_s, duration_s, changed_m_s))
    return after._replace(trailing=tuple(trailing))
