"""Axes for learning whose optimal pulse is known: a formula computes the result of a stroke."""

from collections.abc import Callable, Generator
from typing import TypeVar

import numpy as np
from scipy.signal import fftconvolve

from kernels.arrays import Array
from servo_ctrl.learning.schedule import LearningRun
from servo_ctrl.learning.types import NO_PULSE, Learned, LearningSettings, Pulse, Stroke, StrokeResult

SETTINGS = LearningSettings(
    learner="paper",
    accelerations_m_s2=(0.002, 0.008, 0.03, 0.12),
    steps=(2, 1, 2),
    coarse_steps=9,
    fine_steps=4,
    initial_share=0.1,
    duration_step_s=0.01,
    duration_reach=1.6,
    window_durations=2.0,
    trailing=False,
    radius_m=0.05,
    amplitude_max_m_s=0.002,
    rise_s=0.01,
    window_s=0.1,
)
PERIOD_S = 1e-3
Result = TypeVar("Result")


def follow(
    learning: Generator[Stroke, StrokeResult, Result], axis: Callable[[Stroke], StrokeResult]
) -> tuple[Result, list[Stroke]]:
    """Make all strokes of a learning stage; return its result and the strokes."""
    strokes = [next(learning)]
    while True:
        try:
            strokes.append(learning.send(axis(strokes[-1])))
        except StopIteration as end:
            return end.value, strokes


def whole_run(
    settings: LearningSettings, axis: Callable[[Stroke], StrokeResult]
) -> tuple[Learned, list[tuple[Stroke, StrokeResult]]]:
    """Run a learning run to its end; return its result and journal."""
    run, journal = LearningRun(settings), []
    while (stroke := run.stroke) is not None:
        result = axis(stroke)
        journal.append((stroke, result))
        run.take(result)
    assert run.learned is not None
    return run.learned, journal


class ScoredAxis:
    """J of a pulse is `score(a, T, A)`, metres; without one the error peaks at `interval(a)`."""

    def __init__(
        self, interval: Callable[[float], float], score: Callable[[float, float, float], float]
    ) -> None:
        self._interval, self._score = interval, score

    def __call__(self, stroke: Stroke) -> StrokeResult:
        a, pulse = stroke.acceleration_m_s2, stroke.pulse
        if pulse == NO_PULSE:
            error_m = np.full((2, 800), 1e-6)
            error_m[:, round(self._interval(a) / PERIOD_S)] = 9e-6
        else:
            signs = np.where(np.arange(800) % 2, 1.0, -1.0)
            error_m = np.tile(signs * self._score(a, pulse.duration_s, pulse.amplitude_m_s), (2, 1))
        return StrokeResult(error_m, PERIOD_S)


class LinearAxis:
    """e = h * (p_best - p), h(t) = exp(-20 t) cos(20 t): the optimal pulse leaves no error."""

    def __init__(self, best: Callable[[float], Pulse], settings: LearningSettings) -> None:
        self._best, self._settings = best, settings

    def __call__(self, stroke: Stroke) -> StrokeResult:
        wanted = trapezoids(self._best(stroke.acceleration_m_s2), self._settings.rise_s, 800)
        made = trapezoids(stroke.pulse, self._settings.rise_s, 800)
        error_m = fftconvolve(response(800), wanted - made)[:800] * PERIOD_S
        return StrokeResult(np.round(np.tile(error_m, (2, 1)), 9), PERIOD_S)


def response(samples: int) -> Array:
    """Return the impulse response h (samples,)."""
    time_s = np.arange(samples) * PERIOD_S
    return np.asarray(np.exp(-20.0 * time_s) * np.cos(20.0 * time_s))


def trapezoids(pulse: Pulse, rise_s: float, samples: int) -> Array:
    """Return both trapezoids (samples,), from their corners."""
    time_s = np.arange(samples) * PERIOD_S
    total = np.zeros(samples)
    for start_s, duration_s, amplitude in ((0.0, *pulse[:2]), pulse[2:]):
        top = min(1.0, 0.5 * duration_s / rise_s)
        corners = start_s + np.array([0.0, top * rise_s, duration_s - top * rise_s, duration_s])
        total += amplitude * np.interp(time_s, corners, [0.0, top, top, 0.0])
    return total
