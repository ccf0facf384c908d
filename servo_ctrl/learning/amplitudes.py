"""Pulse amplitude learning, coarse and fine (Feng et al. 2015, sections 4.1 and 4.2)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from servo_ctrl.learning.durations import coarse_amplitudes_m_s
from servo_ctrl.learning.stroke_result import evaluation_m, window_s
from servo_ctrl.learning.types import Pulse, Stroke

if TYPE_CHECKING:
    from collections.abc import Generator, Sequence

    from servo_ctrl.learning.types import LearningSettings, StrokeResult

    Points = tuple[tuple[float, float], ...]
    Learning = Generator[Stroke, StrokeResult, Points]


SMALLEST_SHARE = 1e-3
"""Of A_max: smaller amplitudes are not tried. As good as none, but their logarithm is finite."""


def coarse_accelerations(settings: LearningSettings) -> list[float]:
    """a_min to a_max: N_1, N_2 and N_3 equal steps in the three intervals, m/s^2."""
    ends = settings.accelerations_m_s2
    parts = [np.linspace(ends[i], ends[i + 1], n + 1)[:-1] for i, n in enumerate(settings.steps)]
    return [*np.concatenate(parts).tolist(), ends[-1]]


def learn_amplitudes(settings: LearningSettings, durations: Points) -> Learning:
    """Strokes in, (acceleration, A*) out, at the coarse accelerations and midway between them."""
    coarse = coarse_amplitudes_m_s(settings)
    found = {}
    for a in coarse_accelerations(settings):
        found[a] = yield from _best(settings, durations, "coarse", a, coarse)
    reach = coarse[1] - coarse[0]
    fine = {}
    for a, middle in with_midpoints(list(found.items())):
        tried = fine_amplitudes_m_s(settings, middle, reach)
        fine[a] = yield from _best(settings, durations, "fine", a, tried)
    return tuple(fine.items())


def fine_amplitudes_m_s(settings: LearningSettings, middle_m_s: float, reach_m_s: float) -> list[float]:
    """A -+ dA_c in N_f steps; what would leave (0, A_max] is cut off and the steps are shorter."""
    lowest = max(middle_m_s - reach_m_s, smallest_amplitude_m_s(settings))
    highest = min(middle_m_s + reach_m_s, settings.amplitude_max_m_s)
    return [float(amplitude) for amplitude in np.linspace(lowest, highest, settings.fine_steps + 1)]


def smallest_amplitude_m_s(settings: LearningSettings) -> float:
    """The smallest that is learned."""
    return SMALLEST_SHARE * settings.amplitude_max_m_s


def with_midpoints(points: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """The points, and between each two of them their mean in both coordinates."""
    table = np.array(points)
    between = 0.5 * (table[1:] + table[:-1])
    merged = np.concatenate((table, between))
    return [(float(a), float(value)) for a, value in merged[np.argsort(merged[:, 0])]]


def _best(
    settings: LearningSettings, durations: Points, stage: str, a: float, amplitudes: Sequence[float]
) -> Generator[Stroke, StrokeResult, float]:
    """The amplitude of the least J over Tm, a multiple of T*(a)."""
    duration_s = float(np.interp(a, *np.array(durations).T))
    scores = []
    for amplitude_m_s in amplitudes:
        result = yield Stroke(stage, a, Pulse(duration_s, amplitude_m_s))
        scores.append((evaluation_m(result, window_s(settings, duration_s)), amplitude_m_s))
    return min(scores)[1]
