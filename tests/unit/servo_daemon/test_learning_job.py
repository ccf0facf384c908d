"""Learning on a fake machine: its strokes, its results, and results that are not used."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from learning_stand import STROKES, LearningStand, learned_once

from servo_ctrl.commands.command import Command, CommandRequest
from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.commands.stage import Stage
from servo_ctrl.daemon.learning.axis_learning import REPEATS_MAX
from servo_ctrl.daemon.run.run_options import LearningRequest
from servo_ctrl.learning.types import NO_PULSE

START_X = CommandRequest(Command.START_LEARNING, "x")


def test_every_stroke_is_made_with_its_own_pulse_and_the_result_is_used_and_stored(
    stand: Callable[..., LearningStand], tmp_path: Path
) -> None:
    made = stand()
    assert not made.pulse("x").enabled
    assert made.handler.execute(START_X).accepted
    for number, stroke in enumerate(STROKES):
        learning = made.status.learning
        assert learning.planned
        assert (made.status.learning.state, learning.strokes_done) == (LearningState.RUNNING, number)
        pulse = made.pulse("x")
        assert pulse.enabled == (stroke.pulse != NO_PULSE)
        assert pulse.learned[1:, 0].tolist() == list(stroke.pulse)
        assert not made.pulse("y").enabled
        made.play()
    now = made.status
    assert (now.learning.state, now.learning.axis) == (LearningState.DONE, "x")
    assert (now.axes[0].version, now.axes[1].version) == (1, 0)
    learned = now.axes[0].learned
    assert learned is not None
    assert (learned.before_m, learned.after_m) == pytest.approx((5e-6, 1e-6), abs=1e-9)
    assert made.pulse("x").enabled
    assert made.pulse("x").learned[2, [0, -1]] == pytest.approx([0.001, 0.0012])
    stored = json.loads((tmp_path / "learned" / "x" / "v0001.json").read_text(encoding="utf-8"))
    assert stored["conditions"]["source"] == "learning"
    assert not (tmp_path / "learned" / "x" / "journal.jsonl").exists()
    assert made.machine.notes == ["axis x: J 5.00 um -> 1.00 um, 4 strokes, version 1 in use"]


def test_all_axes_are_learned_one_after_the_other(stand: Callable[..., LearningStand]) -> None:
    made = stand()
    assert made.handler.execute(CommandRequest(Command.START_LEARNING)).accepted
    seen = []
    for _ in range(2 * len(STROKES)):
        seen.append(made.status.learning.axis)
        made.play()
    assert seen == ["x"] * len(STROKES) + ["y"] * len(STROKES)
    assert [axis.version for axis in made.status.axes] == [1, 1]
    assert made.status.learning.state is LearningState.DONE


def test_axis_that_is_named_twice_is_learned_once(stand: Callable[..., LearningStand]) -> None:
    made = stand()
    assert made.handler.learn(["x", "x"], None, fresh=False).accepted
    for _ in STROKES:
        made.play()
    assert made.status.learning.state is LearningState.DONE
    assert [outcome.axis for outcome in made.services.learning.job.outcomes] == ["x"]


def test_next_run_uses_what_was_stored(stand: Callable[..., LearningStand]) -> None:
    table = learned_once(stand()).pulse("x").learned
    again = stand()
    assert again.status.axes[0].version == 1
    assert again.pulse("x").enabled
    np.testing.assert_array_equal(again.pulse("x").learned, table)


def test_a_result_that_is_no_better_is_not_used(stand: Callable[..., LearningStand], tmp_path: Path) -> None:
    made = stand()
    made.lag_with_pulse_m = made.lag_m
    made.handler.execute(START_X)
    for _ in STROKES:
        made.play()
    learning = made.status.learning
    assert learning.state is LearningState.FAILED
    assert learning.reason.startswith("axis x: what was learned is no better and is not used")
    assert made.status.axes[0].version == 0
    assert not made.pulse("x").enabled
    assert not (tmp_path / "learned" / "x" / "journal.jsonl").exists()


AT_AN_ERROR, BEFORE_THE_REVERSALS = 130, 40
"""Samples of a stroke; its first reversal is at about 100."""


def test_stroke_with_missing_samples_is_repeated_a_bounded_number_of_times(
    stand: Callable[..., LearningStand],
) -> None:
    made = stand()
    made.handler.execute(START_X)
    made.play(AT_AN_ERROR)
    made.play(skip=5)
    problem = "a position sample is missing in the stroke"
    assert made.machine.notes == [f"axis x: a stroke is repeated: {problem}"]
    learning = made.status.learning
    assert learning.planned
    assert (made.machine.stage, learning.strokes_done) == (Stage.RUNNING, 0)
    for _ in range(REPEATS_MAX):
        made.play(AT_AN_ERROR)
        made.play(skip=5)
    assert made.status.learning.state is LearningState.FAILED
    failed = f"axis x: 6 consecutive strokes are invalid: {problem}; run "
    assert made.status.learning.reason.startswith(failed)


def test_missed_ticks_elsewhere_in_a_stroke_do_no_harm(stand: Callable[..., LearningStand]) -> None:
    made = stand()
    made.handler.execute(START_X)
    for _ in STROKES:
        made.play(BEFORE_THE_REVERSALS)
        made.play(skip=7)
    learned = made.status.axes[0].learned
    assert learned is not None
    assert (learned.before_m, learned.after_m) == pytest.approx((5e-6, 1e-6), abs=1e-9)


def test_full_disk_ends_learning_and_keeps_the_functions_in_use(
    stand: Callable[..., LearningStand], tmp_path: Path
) -> None:
    made = stand()
    (tmp_path / "learned").write_text("in the way", encoding="utf-8")
    made.handler.execute(START_X)
    if made.status.learning.state is LearningState.RUNNING:
        made.play()
    learning = made.status.learning
    assert learning.state is LearningState.FAILED
    assert "learned" in learning.reason
    assert not made.pulse("x").enabled


def test_learning_run_of_the_command_line_ends_the_run_when_done(stand: Callable[..., LearningStand]) -> None:
    made = stand(learn=LearningRequest(("y",), "paper"))
    made.services.on_ready()
    assert made.status.learning.axis == "y"
    for _ in STROKES:
        assert made.machine.finished == 0
        made.play()
    assert made.machine.finished == 1
    assert (made.services.completed, made.services.problem) == (True, "")


def test_learning_run_that_fails_ends_the_run_with_its_reason(stand: Callable[..., LearningStand]) -> None:
    made = stand(learn=LearningRequest(("y",)))
    made.lag_with_pulse_m = made.lag_m
    made.services.on_ready()
    for _ in STROKES:
        made.play()
    assert made.machine.finished == 1
    assert not made.services.completed
    assert made.services.problem.startswith("axis y: what was learned is no better")


def test_production_is_not_monitored_during_strokes(stand: Callable[..., LearningStand]) -> None:
    made = learned_once(stand())
    assert [axis.reversals for axis in made.status.axes] == [0, 0]
    assert len(made.rows) > 1000, "but all is recorded"
