"""The second trapezoid, learned on top of the paper's pulse functions (ours).

One stroke with the pulse and one without show the response of the error; then a few have a second trapezoid.
"""

from collections.abc import Generator

import numpy as np

from servo_ctrl.learning.fast import ACCELERATIONS, TRAILING, TRAILING_STROKES, Search, refine
from servo_ctrl.learning.pulse_functions import pulse_at
from servo_ctrl.learning.response import KNOTS_S, Tried, least
from servo_ctrl.learning.stroke_result import first_samples, window_s
from servo_ctrl.learning.types import NO_PULSE, Learned, LearningSettings, Pulse, Stroke, StrokeResult

Points = tuple[tuple[float, float, float, float], ...]


def learn_trailing(settings: LearningSettings, learned: Learned) -> Generator[Stroke, StrokeResult, Points]:
    """Strokes in, (acceleration, start, duration, amplitude) of the second trapezoid out."""
    a_min, *_, a_max = settings.accelerations_m_s2
    found: list[tuple[float, Pulse]] = []
    heights = np.zeros(len(KNOTS_S))
    for a in reversed(np.geomspace(a_min, a_max, ACCELERATIONS).tolist()):
        main = pulse_at(learned, a)
        span_s = window_s(settings, main.duration_s)
        tried = []
        for pulse in (NO_PULSE, main):
            result = yield Stroke("trailing", a, pulse)
            tried.append(Tried(pulse, first_samples(result, span_s)))
        search = Search("trailing", a, span_s, result.period_s, TRAILING_STROKES, TRAILING, found[-1:])
        heights = yield from refine(settings, search, tried, heights)
        found.append((a, least(tried[1:]).pulse))
    return tuple((a, *pulse[2:]) for a, pulse in reversed(found))
