"""Pulse duration learning at a_min, a_1, a_2, a_max (Feng et al. 2015, section 3)."""

from collections.abc import Generator

import numpy as np

from servo_ctrl.learning.stroke_result import evaluation_m, interval_s, window_s
from servo_ctrl.learning.types import NO_PULSE, LearningSettings, Pulse, Stroke, StrokeResult

Learning = Generator[Stroke, StrokeResult, tuple[tuple[float, float], ...]]


ROUNDING = 1.0 + 1e-9
"""Keeps rounding errors from dropping the last duration of the range."""


def coarse_amplitudes_m_s(settings: LearningSettings) -> list[float]:
    """N_c + 1 amplitudes from A_0 to A_max in steps of dA_c, m/s."""
    highest = settings.amplitude_max_m_s
    steps = np.linspace(settings.initial_share * highest, highest, settings.coarse_steps + 1)
    return [float(amplitude) for amplitude in steps]


def sweep_m_s(settings: LearningSettings) -> list[float]:
    """Amplitudes of the duration stage, m/s: dA = 2 dA_c, since the duration needs no finer ones."""
    return coarse_amplitudes_m_s(settings)[::2]


def durations_tried_s(settings: LearningSettings, first_s: float) -> list[float]:
    """Durations from the interval t2 - t1 (at least dT) to `duration_reach` times it, in steps of dT."""
    step_s = settings.duration_step_s
    begin_s = max(first_s, step_s)
    count = int((settings.duration_reach - 1.0) * begin_s / step_s * ROUNDING) + 1
    return [begin_s + step * step_s for step in range(count)]


def learn_durations(settings: LearningSettings) -> Learning:
    """Yield strokes, return (acceleration, T*).

    First measure the interval t2 - t1 at all four accelerations, without compensation. Then sweep the
    amplitude at each duration and keep the duration of the least Jd. Jd is the mean |e| over Tm, not over t2
    - t1 as in the paper: durations begin at t2 - t1, so the end of the pulse would lie outside
    (docs/decisions/0009).
    """
    intervals = []
    for a in settings.accelerations_m_s2:
        result = yield Stroke("interval", a, NO_PULSE)
        intervals.append(interval_s(result))
    best = []
    for a, first_s in zip(settings.accelerations_m_s2, intervals, strict=True):
        scores = []
        for duration_s in durations_tried_s(settings, first_s):
            for amplitude_m_s in sweep_m_s(settings):
                result = yield Stroke("duration", a, Pulse(duration_s, amplitude_m_s))
                scores.append((evaluation_m(result, window_s(settings, first_s)), duration_s))
        best.append((a, min(scores)[1]))
    return tuple(best)
