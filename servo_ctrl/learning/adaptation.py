"""Learning from production reversals, without strokes of its own (ours; off by default).

The error that is left after a reversal says what the amplitude should have been: where the table lags over
the pulse it was too small, where it runs ahead too large. The amplitudes at the nearest learned accelerations
move by a small share of that, and the durations stay. It follows slow changes; after a jump, or where the
shape of the error changes, learning with strokes finds more.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from servo_ctrl.learning.pulse_functions import pulse_at
from servo_ctrl.learning.stroke_result import first_samples

if TYPE_CHECKING:
    from servo_ctrl.learning.types import Learned, LearningSettings, StrokeResult

GAIN = 0.5
"""Relative change of the amplitude per error, in units of the way that the pulse makes."""
LARGEST_STEP = 0.03
"""Share of the amplitude that one reversal may change."""
REACH = 1.6
"""Ratio of accelerations over which a reversal is heard."""


def adapted(
    learned: Learned, settings: LearningSettings, acceleration_m_s2: float, result: StrokeResult
) -> Learned | None:
    """The functions after one more reversal; None when it says nothing.

    Reversals outside the learned accelerations say nothing about the functions inside, and a mean error as
    small as learning itself left behind is not held against the pulse.
    """
    a_min, *_, a_max = settings.accelerations_m_s2
    if not a_min <= acceleration_m_s2 <= a_max:
        return None
    pulse = pulse_at(learned, acceleration_m_s2)
    way_m = pulse.amplitude_m_s * max(pulse.duration_s - settings.rise_s, settings.rise_s)
    if way_m <= 0.0:
        return None
    lag_m = float(np.mean(first_samples(result, pulse.duration_s)))
    if abs(lag_m) <= learned.after_m:
        return None
    step = float(np.clip(GAIN * lag_m / way_m, -LARGEST_STEP, LARGEST_STEP))
    amplitudes = []
    for a, amplitude_m_s in learned.amplitudes:
        nearness = max(0.0, 1.0 - abs(np.log(a / acceleration_m_s2)) / np.log(REACH))
        changed = amplitude_m_s * (1.0 + step * nearness)
        amplitudes.append((a, float(min(changed, settings.amplitude_max_m_s))))
    return learned._replace(amplitudes=tuple(amplitudes))
