"""Runs the stages of learning in order: the next stroke, and the progress.

The stages are generators: they yield strokes and receive results. The same results give the same strokes, so
a run resumes by replaying the results that it already has.
"""

import math
from collections.abc import Generator
from itertools import pairwise, takewhile

import numpy as np

from servo_ctrl.learning.amplitudes import coarse_accelerations, learn_amplitudes
from servo_ctrl.learning.durations import durations_tried_s, learn_durations, sweep_m_s
from servo_ctrl.learning.fast import (
    ACCELERATIONS,
    SEARCH_STROKES,
    TRAILING_STROKES,
    learn_fast,
    learn_trailing,
)
from servo_ctrl.learning.grnn import leave_one_out_spread
from servo_ctrl.learning.pulse_functions import pulse_at
from servo_ctrl.learning.stroke_result import evaluation_m, interval_s
from servo_ctrl.learning.types import NO_PULSE, Learned, LearningSettings, Outlook, Stroke, StrokeResult

CHECKS = 4
"""Number of accelerations at which J is compared without and with the learned functions; chosen."""
EXPECTED_INTERVAL_S = 0.1
"""t2 - t1 assumed for the outlook until it is measured, seconds; chosen."""
RAMP_SHARE = 0.1
"""Duration of the ramps as a share of a sine's period; chosen: they end well before the first reversal."""


def stroke_s(settings: LearningSettings, acceleration_m_s2: float) -> float:
    """Duration of a stroke, seconds: one cycle of the sine and its ramps."""
    return (1.0 + RAMP_SHARE) * 2.0 * math.pi * math.sqrt(settings.radius_m / acceleration_m_s2)


def learn(settings: LearningSettings) -> Generator[Stroke, StrokeResult, Learned]:
    """Run all stages of the learner that the settings name: yield strokes, return the learned functions.

    `LearningRun` fills in strokes and machine time.
    """
    if settings.learner == "fast":
        pulses = yield from learn_fast(settings)
        learned = Learned(
            learner="fast",
            durations=tuple((a, pulse.duration_s) for a, pulse in pulses),
            amplitudes=tuple((a, pulse.amplitude_m_s) for a, pulse in pulses),
            spread_m_s2=0.0,
            trailing=tuple((a, *pulse[2:]) for a, pulse in pulses) if settings.trailing else (),
        )
    else:
        durations = yield from learn_durations(settings)
        amplitudes = yield from learn_amplitudes(settings, durations)
        spread = leave_one_out_spread(*np.array(amplitudes).T)
        learned = Learned("paper", durations, amplitudes, spread)
        if settings.trailing:
            learned = learned._replace(trailing=(yield from learn_trailing(settings, learned)))
    before: list[float] = []
    after: list[float] = []
    for a in check_accelerations(settings):
        for pulse, scores in ((NO_PULSE, before), (pulse_at(learned, a), after)):
            result = yield Stroke("check", a, pulse)
            scores.append(evaluation_m(result, settings.window_s))
    return learned._replace(before_m=float(np.mean(before)), after_m=float(np.mean(after)))


def check_accelerations(settings: LearningSettings) -> list[float]:
    """Accelerations at which J is checked, m/s^2: over the whole range, between the learned ones."""
    a_min, *_, a_max = settings.accelerations_m_s2
    middles = np.geomspace(a_min, a_max, 2 * ACCELERATIONS - 1)[1::2]
    chosen = np.linspace(0, len(middles) - 1, CHECKS).round().astype(int)
    return [float(a) for a in middles[chosen]]


class LearningRun:
    """Learning of one axis: make `stroke`, give `take` its result, until `stroke` is None."""

    def __init__(self, settings: LearningSettings) -> None:
        self.stroke: Stroke | None = None
        """The next stroke to make; None when learning is complete."""
        self.learned: Learned | None = None
        self._settings = settings
        self._stages = learn(settings)
        self._done: list[tuple[str, float]] = []
        """(stage, acceleration) of the completed strokes."""
        self._intervals: dict[float, float] = {}
        self._machine_time_s = 0.0
        self._best_m = math.nan
        self.stroke = next(self._stages)

    def take(self, result: StrokeResult) -> None:
        """Take the result of `stroke`, and determine the next; this may take some tenths of a second."""
        stroke = self.stroke
        if stroke is None:
            raise ValueError("all strokes have been made")
        a = stroke.acceleration_m_s2
        if stroke.stage == "interval":
            self._intervals[a] = interval_s(result)
        score_m = evaluation_m(result, self._settings.window_s)
        is_first_of_group = not self._done or self._done[-1] != (stroke.stage, a)
        self._best_m = score_m if is_first_of_group else min(self._best_m, score_m)
        self._done.append((stroke.stage, a))
        self._machine_time_s += stroke_s(self._settings, a)
        try:
            self.stroke = self._stages.send(result)
        except StopIteration as end:
            self.stroke = None
            self.learned = end.value._replace(strokes=len(self._done), machine_time_s=self._machine_time_s)

    @property
    def outlook(self) -> Outlook:
        """Progress of the run."""
        made = len(self._done)
        if self.stroke is None:
            return Outlook("done", made, made, remaining_s=0.0, best_m=self._best_m)
        current = self.stroke.stage, self.stroke.acceleration_m_s2
        remaining = self._remaining_strokes(*current)
        return Outlook(
            stage=self.stroke.stage,
            strokes_done=made,
            strokes_total=made + sum(count for _, count in remaining),
            remaining_s=sum(count * stroke_s(self._settings, a) for a, count in remaining),
            acceleration_m_s2=self.stroke.acceleration_m_s2,
            best_m=self._best_m if self._done[-1:] == [current] else math.nan,
        )

    def _remaining_strokes(self, stage: str, at_m_s2: float) -> list[tuple[float, int]]:
        """(acceleration, strokes) from the present stage on; the fast learner may need fewer."""
        plan = self._plan()
        positions = (i for i, (name, a, _) in enumerate(plan) if name == stage and math.isclose(a, at_m_s2))
        position = next(positions, len(plan) - 1)
        made = sum(1 for _ in takewhile(lambda done: done == (stage, at_m_s2), reversed(self._done)))
        (_, a, count), *later = plan[position:]
        return [(a, max(count - made, 1)), *((a, count) for _, a, count in later)]

    def _plan(self) -> list[tuple[str, float, int]]:
        """(stage, acceleration, strokes) of the whole run, in order."""
        settings = self._settings
        a_min, *_, a_max = settings.accelerations_m_s2
        descending_m_s2 = np.geomspace(a_min, a_max, ACCELERATIONS).tolist()[::-1]
        checks = [("check", a, 2) for a in check_accelerations(settings)]
        if settings.learner == "fast":
            stages = [("interval", 1), ("search", 1 + SEARCH_STROKES)]
            stages += [("trailing", TRAILING_STROKES)] if settings.trailing else []
            return [(stage, a, count) for a in descending_m_s2 for stage, count in stages] + checks
        sweep = settings.coarse_steps + 1
        plan = [("interval", a, 1) for a in settings.accelerations_m_s2]
        for a in settings.accelerations_m_s2:
            first_s = self._intervals.get(a, EXPECTED_INTERVAL_S)
            plan.append(("duration", a, len(sweep_m_s(settings)) * len(durations_tried_s(settings, first_s))))
        coarse = coarse_accelerations(settings)
        fine = sorted({*coarse, *((a + b) / 2.0 for a, b in pairwise(coarse))})
        plan += [("coarse", a, sweep) for a in coarse]
        plan += [("fine", a, settings.fine_steps + 1) for a in fine]
        plan += [("trailing", a, 2 + TRAILING_STROKES) for a in descending_m_s2] if settings.trailing else []
        return plan + checks
