"""Pulse duration learning at a_min, a_1, a_2, a_max (Feng et al. 2015, section 3)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from servo_ctrl.learning.stroke_result import evaluation_m, interval_s, window_s
from servo_ctrl.learning.types import NO_PULSE, Pulse, Stroke

if TYPE_CHECKING:
    from collections.abc import Generator

    from servo_ctrl.learning.types import LearningSettings, StrokeResult

    Learning = Generator[Stroke, StrokeResult, tuple[tuple[float, float], ...]]


ROUNDING = 1.0 + 1e-9
"""A last duration that is in reach but for its last bit is tried."""


def coarse_amplitudes_m_s(settings: LearningSettings) -> list[float]:
    """A_0 by dA_c to A_max, N_c + 1 of them."""
    highest = settings.amplitude_max_m_s
    steps = np.linspace(settings.initial_share * highest, highest, settings.coarse_steps + 1)
    return [float(amplitude) for amplitude in steps]


def sweep_m_s(settings: LearningSettings) -> list[float]:
    """The amplitudes of the duration stage, dA = 2 dA_c: the duration needs no finer ones."""
    return coarse_amplitudes_m_s(settings)[::2]


def durations_tried_s(settings: LearningSettings, first_s: float) -> list[float]:
    """From the interval t2 - t1, at least dT, by dT to `duration_reach` times that."""
    step_s = settings.duration_step_s
    begin_s = max(first_s, step_s)
    count = int((settings.duration_reach - 1.0) * begin_s / step_s * ROUNDING) + 1
    return [begin_s + step * step_s for step in range(count)]


def learn_durations(settings: LearningSettings) -> Learning:
    """Strokes in, (acceleration, T*) out.

    First the intervals t2 - t1 of all four accelerations, without compensation. Then for each duration a
    sweep of the amplitude; the duration of the least Jd is kept. Jd is mean |e| over Tm as everywhere, not
    over t2 - t1 alone: durations begin there, so the pulse's end would lie outside (docs/decisions/0009).
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
