"""A complete learning run: the same results give the same strokes, with progress and remaining time."""

import math
from collections import Counter
from functools import cache

import numpy as np
import pytest
from synthetic_axes import SETTINGS, LinearAxis, whole_run

from servo_ctrl.learning.durations import durations_tried_s
from servo_ctrl.learning.pulse_functions import pulse_at
from servo_ctrl.learning.schedule import LearningRun, check_accelerations, stroke_s
from servo_ctrl.learning.stroke_result import evaluation_m, interval_s
from servo_ctrl.learning.types import (
    NO_PULSE,
    Learned,
    LearningSettings,
    Outlook,
    Pulse,
    Stroke,
    StrokeResult,
)

PAPER = SETTINGS._replace(coarse_steps=3, fine_steps=2)
VARIANTS = [
    PAPER,
    PAPER._replace(trailing=True),
    PAPER._replace(learner="fast"),
    PAPER._replace(learner="fast", trailing=True),
]


@cache
def made(settings: LearningSettings) -> tuple[Learned, list[tuple[Stroke, StrokeResult]]]:
    """One whole run, and its journal."""
    return whole_run(settings, axis_for(settings))


def axis_for(settings: LearningSettings) -> LinearAxis:
    return LinearAxis(
        lambda a: Pulse(0.07 * (0.03 / a) ** 0.4, 0.0007 * (a / 0.03) ** 0.5, 0.14, 0.05, -1e-4), settings
    )


@pytest.mark.parametrize("settings", VARIANTS)
def test_replayed_results_give_the_same_strokes_and_the_same_functions(settings: LearningSettings) -> None:
    learned, journal = made(settings)
    run = LearningRun(settings)
    for stroke, result in journal:
        assert run.stroke == stroke
        assert run.learned is None
        run.take(result)
    assert run.stroke is None
    assert run.learned == learned


@pytest.mark.parametrize("settings", VARIANTS)
def test_remaining_strokes_and_time_are_never_negative_and_end_at_zero(settings: LearningSettings) -> None:
    run, axis = LearningRun(settings), axis_for(settings)
    outlooks: list[Outlook] = []
    while (stroke := run.stroke) is not None:
        outlook = run.outlook
        outlooks.append(outlook)
        assert (outlook.stage, outlook.acceleration_m_s2) == (stroke.stage, stroke.acceleration_m_s2)
        assert outlook.strokes_done == len(outlooks) - 1
        assert outlook.strokes_total > outlook.strokes_done
        assert outlook.remaining_s >= stroke_s(settings, stroke.acceleration_m_s2) * (1 - 1e-12)
        run.take(axis(stroke))
    done = run.outlook
    assert (done.stage, done.strokes_done, done.strokes_total) == ("done", len(outlooks), len(outlooks))
    assert done.remaining_s == 0.0
    assert math.isnan(done.acceleration_m_s2)
    assert outlooks[-1].strokes_total == len(outlooks)


@pytest.mark.parametrize("score", ["inside", "at A_max"])
def test_with_the_papers_learner_the_total_is_exact_once_the_intervals_are_known(score: str) -> None:
    axis = LinearAxis(lambda a: Pulse(0.07, 0.0007 if score == "inside" else 0.02 * a / a), PAPER)
    run, totals, remaining = LearningRun(PAPER), [], []
    while (stroke := run.stroke) is not None:
        if stroke.stage != "interval":
            totals.append(run.outlook.strokes_total)
            remaining.append(run.outlook.remaining_s - stroke_s(PAPER, stroke.acceleration_m_s2))
        run.take(axis(stroke))
        if stroke.stage != "interval":
            assert run.outlook.remaining_s == pytest.approx(remaining[-1], abs=1e-6)
    assert set(totals) == {run.outlook.strokes_done}


def test_the_papers_strokes_are_as_many_as_its_sweeps_have_places() -> None:
    learned, journal = made(PAPER)
    stages = Counter(stroke.stage for stroke, _ in journal)
    intervals = [interval_s(result) for stroke, result in journal if stroke.stage == "interval"]
    assert stages == {
        "interval": 4,
        "duration": sum(2 * len(durations_tried_s(PAPER, first_s)) for first_s in intervals),
        "coarse": 6 * 4,  # 2 + 1 + 2 steps, A_0 by dA_c to A_max
        "fine": 11 * 3,  # and midway between
        "check": 4 * 2,
    }
    assert [len(learned.durations), len(learned.amplitudes)] == [4, 11]
    assert learned.spread_m_s2 > 0.0
    assert learned.strokes == len(journal)
    assert learned.machine_time_s == pytest.approx(
        sum(1.1 * 2.0 * math.pi * math.sqrt(0.05 / stroke.acceleration_m_s2) for stroke, _ in journal)
    )


@pytest.mark.parametrize("settings", VARIANTS)
def test_learned_pulses_are_checked_against_no_pulse_at_untrained_accelerations(
    settings: LearningSettings,
) -> None:
    learned, journal = made(settings)
    checks = [(stroke, evaluation_m(result, settings.window_s)) for stroke, result in journal[-8:]]
    places = check_accelerations(settings)
    assert not set(places) & {a for a, _ in learned.amplitudes}
    pulses = [pulse for a in places for pulse in (NO_PULSE, pulse_at(learned, a))]
    assert [(s.stage, s.acceleration_m_s2) for s, _ in checks] == [("check", a) for a in places for _ in "01"]
    assert [stroke.pulse for stroke, _ in checks] == pulses
    assert learned.before_m == pytest.approx(np.mean([score for _, score in checks[::2]]))
    assert learned.after_m == pytest.approx(np.mean([score for _, score in checks[1::2]]))
    assert learned.after_m < learned.before_m


@pytest.mark.parametrize("settings", VARIANTS)
def test_learned_amplitudes_and_durations_are_positive_numbers(settings: LearningSettings) -> None:
    learned, _ = made(settings)
    assert min(value for _, value in learned.amplitudes) > 0.0
    assert min(value for _, value in learned.durations) > 0.0
    assert bool(learned.trailing) == settings.trailing
    assert np.isfinite([learned.before_m, learned.after_m]).all()


def test_the_best_so_far_belongs_to_one_stage_at_one_acceleration() -> None:
    run, axis = LearningRun(PAPER), axis_for(PAPER)
    scores: list[float] = []
    at: tuple[str, float] | None = None
    while (stroke := run.stroke) is not None:
        if (stroke.stage, stroke.acceleration_m_s2) != at:
            scores, at = [], (stroke.stage, stroke.acceleration_m_s2)
            assert math.isnan(run.outlook.best_m)
        else:
            assert run.outlook.best_m == min(scores)
        result = axis(stroke)
        scores.append(evaluation_m(result, PAPER.window_s))
        run.take(result)


def test_a_result_after_the_end_is_refused() -> None:
    settings = PAPER._replace(learner="fast")
    run, axis = LearningRun(settings), axis_for(settings)
    while (stroke := run.stroke) is not None:
        result = axis(stroke)
        run.take(result)
    with pytest.raises(ValueError, match="all strokes have been made"):
        run.take(result)
