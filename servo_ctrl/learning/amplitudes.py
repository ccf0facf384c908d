"""Pulse amplitude learning, coarse and fine (Feng et al. 2015, sections 4.1 and 4.2)."""

from collections.abc import Generator, Sequence

import numpy as np

from servo_ctrl.learning.durations import coarse_amplitudes_m_s
from servo_ctrl.learning.stroke_result import evaluation_m, window_s
from servo_ctrl.learning.types import LearningSettings, Pulse, Stroke, StrokeResult

Points = tuple[tuple[float, float], ...]
Learning = Generator[Stroke, StrokeResult, Points]


SMALLEST_SHARE = 1e-3
"""Share of A_max that bounds amplitudes from below; chosen: no effect, but a finite logarithm."""


def coarse_accelerations(settings: LearningSettings) -> list[float]:
    """Accelerations from a_min to a_max, m/s^2: N_1, N_2 and N_3 equal steps in the three intervals."""
    ends = settings.accelerations_m_s2
    parts = [np.linspace(ends[i], ends[i + 1], n + 1)[:-1] for i, n in enumerate(settings.steps)]
    return [*np.concatenate(parts).tolist(), ends[-1]]


def learn_amplitudes(settings: LearningSettings, durations: Points) -> Learning:
    """Yield strokes, return (acceleration, A*) at the coarse accelerations and midway between them."""
    coarse = coarse_amplitudes_m_s(settings)
    best_m_s = {}
    for a in coarse_accelerations(settings):
        best_m_s[a] = yield from _best(settings, durations, "coarse", a, coarse)
    step_m_s = coarse[1] - coarse[0]
    fine = {}
    for a, middle in with_midpoints(list(best_m_s.items())):
        tried = fine_amplitudes_m_s(settings, middle, step_m_s)
        fine[a] = yield from _best(settings, durations, "fine", a, tried)
    return tuple(fine.items())


def fine_amplitudes_m_s(settings: LearningSettings, middle_m_s: float, step_m_s: float) -> list[float]:
    """Amplitudes A -+ dA_c in N_f equal steps, clipped to (0, A_max]."""
    lowest = max(middle_m_s - step_m_s, smallest_amplitude_m_s(settings))
    highest = min(middle_m_s + step_m_s, settings.amplitude_max_m_s)
    return [float(amplitude) for amplitude in np.linspace(lowest, highest, settings.fine_steps + 1)]


def smallest_amplitude_m_s(settings: LearningSettings) -> float:
    """Smallest amplitude that is learned, m/s."""
    return SMALLEST_SHARE * settings.amplitude_max_m_s


def with_midpoints(points: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Insert between each two points their mean in both coordinates."""
    table = np.array(points)
    between = 0.5 * (table[1:] + table[:-1])
    merged = np.concatenate((table, between))
    return [(float(a), float(value)) for a, value in merged[np.argsort(merged[:, 0])]]


def _best(
    settings: LearningSettings, durations: Points, stage: str, a: float, amplitudes: Sequence[float]
) -> Generator[Stroke, StrokeResult, float]:
    """Amplitude of the least J over Tm; Tm is a multiple of T*(a)."""
    duration_s = float(np.interp(a, *np.array(durations).T))
    scores = []
    for amplitude_m_s in amplitudes:
        result = yield Stroke(stage, a, Pulse(duration_s, amplitude_m_s))
        scores.append((evaluation_m(result, window_s(settings, duration_s)), amplitude_m_s))
    return min(scores)[1]
