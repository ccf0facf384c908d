"""The fast learner, in which each stroke determines the next one (not in the paper).

The paper sweeps amplitude and duration on a grid and evaluates one number per stroke. This learner uses the
whole error after the reversal: it identifies the response of the error to the pulse (`response`), and from it
the best pulse, so that a few strokes per acceleration are enough.
"""

from collections.abc import Generator, Sequence
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.learning.amplitudes import smallest_amplitude_m_s
from servo_ctrl.learning.pulse_functions import pulse_at, scaled_to
from servo_ctrl.learning.response import (
    KNOTS_S,
    PulseResponse,
    TriedStroke,
    best_pulse,
    best_stroke,
    fit_response,
    rms_m,
    with_trailing,
)
from servo_ctrl.learning.stroke_result import first_samples, interval_s, window_s
from servo_ctrl.learning.types import NO_PULSE, Learned, LearningSettings, Pulse, Stroke, StrokeResult

Learning = Generator[Stroke, StrokeResult, tuple[tuple[float, Pulse], ...]]
TrailingPoints = tuple[tuple[float, float, float, float], ...]

ACCELERATIONS = 9
"""Number of accelerations learned at, from a_min to a_max in equal ratios; chosen."""
SEARCH_STROKES = 5
TRAILING_STROKES = 4
"""Bound the strokes at one acceleration, of the pulse and of its second trapezoid; chosen."""
RELATIVE_IMPROVEMENT_MIN = 0.02
"""Relative improvement of the predicted RMS below which no further stroke is made; chosen."""
TIME_DECIMALS = 6
AMPLITUDE_STEPS = 1_000_000
"""Resolution of pulses: decimals of a second, and fractions of A_max; chosen."""
MAIN = ("amplitude_m_s", "duration_s")
TRAILING = ("trailing_amplitude_m_s", "trailing_start_s", "trailing_duration_s")


def learn_fast(settings: LearningSettings) -> Learning:
    """Yield strokes, return (acceleration, pulse); from the highest acceleration down."""
    a_min, *_, a_max = settings.accelerations_m_s2
    pulses: list[tuple[float, Pulse]] = []
    knot_values = np.zeros(len(KNOTS_S))
    for a in reversed(np.geomspace(a_min, a_max, ACCELERATIONS).tolist()):
        uncompensated = yield Stroke("interval", a, NO_PULSE)
        span_s = window_s(settings, interval_s(uncompensated))
        tried = [TriedStroke(NO_PULSE, first_samples(uncompensated, span_s))]
        guess = first_guess(uncompensated, settings)
        result = yield Stroke("search", a, guess)
        tried.append(TriedStroke(guess, first_samples(result, span_s)))
        search = Search(
            stage="search",
            acceleration_m_s2=a,
            span_s=span_s,
            period_s=uncompensated.period_s,
            strokes=SEARCH_STROKES,
            free_fields=MAIN,
        )
        knot_values = yield from refine(settings, search, tried, knot_values)
        if settings.trailing:
            search = search._replace(
                stage="trailing",
                strokes=TRAILING_STROKES,
                free_fields=(*TRAILING, *MAIN),
                neighbour=pulses[-1:],
            )
            knot_values = yield from refine(settings, search, tried, knot_values)
        pulses.append((a, best_stroke(tried[1:]).pulse))
    return tuple(reversed(pulses))


def learn_trailing(
    settings: LearningSettings, learned: Learned
) -> Generator[Stroke, StrokeResult, TrailingPoints]:
    """Learn the second trapezoid on top of the paper's pulses: yield strokes, return `Learned.trailing`.

    One stroke with the pulse and one without identify the response of the error; a few more have a second
    trapezoid.
    """
    a_min, *_, a_max = settings.accelerations_m_s2
    pulses: list[tuple[float, Pulse]] = []
    knot_values = np.zeros(len(KNOTS_S))
    for a in reversed(np.geomspace(a_min, a_max, ACCELERATIONS).tolist()):
        main = pulse_at(learned, a)
        span_s = window_s(settings, main.duration_s)
        tried = []
        for pulse in (NO_PULSE, main):
            result = yield Stroke("trailing", a, pulse)
            tried.append(TriedStroke(pulse, first_samples(result, span_s)))
        search = Search(
            stage="trailing",
            acceleration_m_s2=a,
            span_s=span_s,
            period_s=result.period_s,
            strokes=TRAILING_STROKES,
            free_fields=TRAILING,
            neighbour=pulses[-1:],
        )
        knot_values = yield from refine(settings, search, tried, knot_values)
        pulses.append((a, best_stroke(tried[1:]).pulse))
    return tuple((a, *pulse[2:]) for a, pulse in reversed(pulses))


def first_guess(uncompensated: StrokeResult, settings: LearningSettings) -> Pulse:
    """Return the first pulse, from the error without one; its duration is t2 - t1, as in the paper at first.

    Its area is twice the peak of the error: once to recover the error, once more against friction.
    """
    duration_s = max(interval_s(uncompensated), 2.0 * settings.rise_s)
    height_m = float(np.abs(uncompensated.error_m).max())
    amplitude_m_s = max(2.0 * height_m / duration_s, smallest_amplitude_m_s(settings))
    return in_whole_steps(Pulse(duration_s, amplitude_m_s), settings.amplitude_max_m_s)


class Search(NamedTuple):
    """A search by a few strokes at one acceleration."""

    stage: str
    acceleration_m_s2: float
    span_s: float
    """Time after the reversal in which the error is evaluated."""
    period_s: float
    strokes: int
    """Largest number of strokes."""
    free_fields: tuple[str, ...]
    """Fields of the pulse that may change."""
    neighbour: Sequence[tuple[float, Pulse]] = ()
    """(acceleration, pulse) of the previous acceleration; empty at the first."""


def refine(
    settings: LearningSettings, search: Search, tried: list[TriedStroke], knot_values: Array
) -> Generator[Stroke, StrokeResult, Array]:
    """Yield strokes with the pulse of least predicted error, and append them to `tried`.

    The first of `tried` has no pulse: it serves to identify the response, and is never the best one.
    Return the identified response, a start for the next acceleration.
    """
    amplitudes = smallest_amplitude_m_s(settings), settings.amplitude_max_m_s
    response = PulseResponse(knot_values, settings.rise_s, search.period_s, *amplitudes)
    for _ in range(search.strokes):
        best = best_stroke(tried[1:])
        if len(tried) > 2 and all(stroke is not best for stroke in tried[-2:]):
            break
        response = fit_response(tried, best, response)
        starts = [best.pulse]
        if "trailing_start_s" in search.free_fields and best.pulse.trailing_amplitude_m_s == 0.0:
            starts += [with_trailing(best, response), *scaled_trailing(best.pulse, search)]
        candidates = (best_pulse(best, response, start, search.free_fields) for start in starts)
        pulse, predicted_m = min(candidates, key=lambda entry: entry[1])
        if predicted_m >= (1.0 - RELATIVE_IMPROVEMENT_MIN) * rms_m(best.error_m):
            break
        pulse = in_whole_steps(pulse, settings.amplitude_max_m_s)
        result = yield Stroke(search.stage, search.acceleration_m_s2, pulse)
        tried.append(TriedStroke(pulse, first_samples(result, search.span_s)))
    return response.knot_values


def in_whole_steps(pulse: Pulse, highest_m_s: float) -> Pulse:
    """Round times to microseconds and amplitudes to millionths of A_max.

    The last bits of linear algebra depend on processor and threads, but a resumed run must request the same
    strokes again.
    """

    def amplitude(value_m_s: float) -> float:
        steps = round(value_m_s / highest_m_s * AMPLITUDE_STEPS)
        return min(max(steps / AMPLITUDE_STEPS, -1.0), 1.0) * highest_m_s

    return Pulse(
        round(pulse.duration_s, TIME_DECIMALS),
        amplitude(pulse.amplitude_m_s),
        round(pulse.trailing_start_s, TIME_DECIMALS),
        round(pulse.trailing_duration_s, TIME_DECIMALS),
        amplitude(pulse.trailing_amplitude_m_s),
    )


def scaled_trailing(pulse: Pulse, search: Search) -> list[Pulse]:
    """The pulse with the second trapezoid of the previous acceleration, scaled to this one."""
    return [
        Pulse(*pulse[:2], *scaled_to((a, *other[2:]), search.acceleration_m_s2)[1:])
        for a, other in search.neighbour
    ]
