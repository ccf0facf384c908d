"""Learning through all its states, on a machine that is pretended: pauses, aborts, faults, restarts."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from learning_stand import PULSE, STROKES, LearningStand, short_learning

from servo_ctrl.axis.fault_policy import Stage
from servo_ctrl.config.desk import Command, LearningState, Refusal, Request, Setting
from servo_ctrl.config.errors import ConfigError, ServoCtrlError
from servo_ctrl.daemon.learner import REPEATS
from servo_ctrl.daemon.learning_states import TRANSITIONS, LearningEvent, following
from servo_ctrl.daemon.services import LearningRequest
from servo_ctrl.learning.types import NO_PULSE

if TYPE_CHECKING:
    from collections.abc import Callable

START_X = Request(Command.START_LEARNING, "x")


@pytest.fixture
def stand(
    machine_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., LearningStand]:
    short_learning(monkeypatch)
    return lambda **options: LearningStand(machine_file, tmp_path / "learned", **options)


def learned_once(made: LearningStand, axis: str = "x") -> LearningStand:
    assert made.desk.execute(Request(Command.START_LEARNING, axis)).accepted
    for _ in STROKES:
        made.play()
    assert made.status.learning.state is LearningState.DONE
    return made


def test_every_stroke_is_made_with_its_own_pulse_and_the_result_is_used_and_stored(
    stand: Callable[..., LearningStand], tmp_path: Path
) -> None:
    made = stand()
    assert not made.pulse("x").enabled
    assert made.desk.execute(START_X).accepted
    for number, stroke in enumerate(STROKES):
        outlook = made.status.learning.outlook
        assert outlook is not None
        assert (made.status.learning.state, outlook.strokes_done) == (LearningState.RUNNING, number)
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
    assert made.desk.execute(Request(Command.START_LEARNING)).accepted
    seen = []
    for _ in range(2 * len(STROKES)):
        seen.append(made.status.learning.axis)
        made.play()
    assert seen == ["x"] * len(STROKES) + ["y"] * len(STROKES)
    assert [axis.version for axis in made.status.axes] == [1, 1]
    assert made.status.learning.state is LearningState.DONE


def test_next_run_uses_what_was_stored(stand: Callable[..., LearningStand]) -> None:
    table = learned_once(stand()).pulse("x").learned
    again = stand()
    assert again.status.axes[0].version == 1
    assert again.pulse("x").enabled
    np.testing.assert_array_equal(again.pulse("x").learned, table)


@pytest.mark.parametrize("stage", [s for s in Stage if s is not Stage.READY])
def test_learning_is_refused_unless_the_machine_is_ready(
    stand: Callable[..., LearningStand], stage: Stage
) -> None:
    made = stand()
    made.machine.stage = stage
    verdict = made.desk.execute(START_X)
    assert verdict.refusal is Refusal.WRONG_STATE
    assert stage.name.lower().replace("_", " ") in verdict.reason
    assert made.status.learning.state is LearningState.IDLE


def test_learning_is_refused_while_learning(stand: Callable[..., LearningStand]) -> None:
    made = stand()
    made.desk.execute(START_X)
    made.play(10)
    verdict = made.desk.execute(Request(Command.START_LEARNING, "y"))
    assert (verdict.refusal, verdict.reason) == (
        Refusal.WRONG_STATE,
        "learning is running already; abort it first",
    )
    for command in (Command.START_PROGRAM, Command.ROLL_BACK):
        assert made.desk.execute(Request(command)).refusal is Refusal.WRONG_STATE
    assert made.status.learning.axis == "x"


def test_axis_that_is_named_twice_is_learned_once(stand: Callable[..., LearningStand]) -> None:
    made = stand()
    assert made.desk.learn(["x", "x"], None, fresh=False).accepted
    for _ in STROKES:
        made.play()
    assert made.status.learning.state is LearningState.DONE
    assert [outcome.axis for outcome in made.services.job.outcomes] == ["x"]


def test_unknown_axis_and_command_are_refused(stand: Callable[..., LearningStand]) -> None:
    made = stand()
    verdict = made.desk.execute(Request(Command.START_LEARNING, "z"))
    assert (verdict.refusal, verdict.reason) == (Refusal.UNKNOWN, 'there is no axis "z", only x, y')
    unknown: Any = 99
    assert made.desk.execute(Request(unknown)).refusal is Refusal.UNKNOWN
    assert made.desk.change(unknown, 1.0).refusal is Refusal.UNKNOWN


def test_strokes_beyond_the_limits_are_refused_before_anything_moves(
    machine_file: Path, tmp_path: Path
) -> None:
    text = machine_file.read_text(encoding="utf-8").replace("radius_mm = 2.0", "radius_mm = 120.0")
    machine_file.write_text(text, encoding="utf-8")
    made = LearningStand(machine_file, tmp_path / "learned")
    verdict = made.desk.execute(START_X)
    assert verdict.refusal is Refusal.OUT_OF_RANGE
    assert "position -120 mm is beyond the limit -100 mm" in verdict.reason
    assert made.machine.program is None
    with pytest.raises(ServoCtrlError, match="position -120 mm is beyond the limit -100 mm"):
        LearningStand(machine_file, tmp_path / "learned", learn=LearningRequest(("x",)))


def test_pause_ends_the_present_stroke_and_resume_goes_on(stand: Callable[..., LearningStand]) -> None:
    made = stand()
    made.desk.execute(START_X)
    made.play(20)
    assert made.desk.execute(Request(Command.PAUSE_LEARNING)).accepted
    assert made.status.learning.state is LearningState.PAUSING
    made.play()
    assert (made.status.learning.state, made.machine.stage) == (LearningState.PAUSED, Stage.READY)
    assert not made.pulse("x").enabled
    assert made.desk.execute(Request(Command.RESUME_LEARNING)).accepted
    for _ in STROKES[1:]:
        made.play()
    assert made.status.learning.state is LearningState.DONE


def test_resume_before_the_pause_has_begun_is_as_if_nothing_was(stand: Callable[..., LearningStand]) -> None:
    made = stand()
    made.desk.execute(START_X)
    made.desk.execute(Request(Command.PAUSE_LEARNING))
    assert made.desk.execute(Request(Command.RESUME_LEARNING)).accepted
    for _ in STROKES:
        made.play()
    assert made.status.learning.state is LearningState.DONE


def test_abort_ramps_down_and_forgets_the_strokes_but_keeps_the_functions_in_use(
    stand: Callable[..., LearningStand], tmp_path: Path
) -> None:
    made = learned_once(stand())
    table = made.pulse("x").learned
    made.desk.execute(START_X)
    made.play()
    made.play(20)
    assert made.pulse("x").learned[1:, 0].tolist() == list(PULSE)
    assert made.desk.execute(Request(Command.ABORT_LEARNING)).accepted
    assert (made.machine.interrupted, made.status.learning.state) == (1, LearningState.ABORTED)
    assert made.pulse("x").learned is table
    made.rest()
    assert made.status.learning.state is LearningState.ABORTED
    assert not (tmp_path / "learned" / "x" / "journal.jsonl").exists()
    assert made.status.axes[0].version == 1
    assert made.desk.execute(START_X).accepted
    outlook = made.status.learning.outlook
    assert outlook is not None
    assert outlook.strokes_done == 0


def test_fault_keeps_the_functions_in_use_and_the_strokes_for_the_next_run(
    stand: Callable[..., LearningStand],
) -> None:
    made = learned_once(stand())
    table = made.pulse("x").learned
    made.desk.execute(START_X)
    made.play()
    made.play()
    made.play(20)
    made.stop("axis y: the drive is in fault")
    learning = made.status.learning
    assert (learning.state, learning.reason) == (LearningState.FAILED, "axis y: the drive is in fault")
    assert made.pulse("x").learned is table
    made.stop("again")
    assert made.status.learning.reason == "axis y: the drive is in fault"
    following_run = stand()
    following_run.desk.execute(START_X)
    outlook = following_run.status.learning.outlook
    assert outlook is not None
    assert outlook.strokes_done == 2
    assert following_run.machine.notes == ["axis x: learning goes on after 2 strokes made before"]


def test_run_that_was_killed_and_resumed_learns_the_very_same(
    stand: Callable[..., LearningStand], machine_file: Path, tmp_path: Path
) -> None:
    whole = learned_once(LearningStand(machine_file, tmp_path / "whole")).status.axes[0].learned
    torn = stand()
    torn.desk.execute(START_X)
    torn.play()
    torn.play(33)  # and no more is heard of it
    resumed = stand()
    resumed.desk.execute(START_X)
    for _ in STROKES[1:]:
        resumed.play()
    assert resumed.status.axes[0].learned == whole
    assert resumed.services.job.outcomes[0].resumed == 1


def test_fresh_start_forgets_what_was_begun(stand: Callable[..., LearningStand]) -> None:
    begun = stand()
    begun.desk.execute(START_X)
    begun.play()
    made = stand(learn=LearningRequest(("x",), fresh=True))
    made.services.on_ready()
    outlook = made.status.learning.outlook
    assert outlook is not None
    assert outlook.strokes_done == 0


def test_journal_of_other_strokes_is_not_gone_on_with(
    stand: Callable[..., LearningStand], monkeypatch: pytest.MonkeyPatch
) -> None:
    begun = stand()
    begun.desk.execute(START_X)
    begun.play()
    other = STROKES[0]._replace(acceleration_m_s2=0.85)
    monkeypatch.setattr("learning_stand.STROKES", (other, *STROKES[1:]))
    made = stand()
    made.desk.execute(START_X)
    assert made.machine.notes[0].endswith("other strokes than would be made now; learning begins anew")
    outlook = made.status.learning.outlook
    assert outlook is not None
    assert outlook.strokes_done == 0


def test_what_is_no_better_is_not_used(stand: Callable[..., LearningStand], tmp_path: Path) -> None:
    made = stand()
    made.lag_with_pulse_m = made.lag_m
    made.desk.execute(START_X)
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


def test_stroke_that_is_spoilt_at_its_errors_is_made_again_but_not_for_ever(
    stand: Callable[..., LearningStand],
) -> None:
    made = stand()
    made.desk.execute(START_X)
    made.play(AT_AN_ERROR)
    made.play(skip=5)
    said = "a position sample is missing in the stroke"
    assert made.machine.notes == [f"axis x: a stroke is made again: {said}"]
    outlook = made.status.learning.outlook
    assert outlook is not None
    assert (made.machine.stage, outlook.strokes_done) == (Stage.RUNNING, 0)
    for _ in range(REPEATS):
        made.play(AT_AN_ERROR)
        made.play(skip=5)
    assert made.status.learning.state is LearningState.FAILED
    assert made.status.learning.reason.startswith(f"axis x: 6 strokes in a row are spoilt: {said}; run ")


def test_missed_ticks_elsewhere_in_a_stroke_do_no_harm(stand: Callable[..., LearningStand]) -> None:
    made = stand()
    made.desk.execute(START_X)
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
    made.desk.execute(START_X)
    if made.status.learning.state is LearningState.RUNNING:
        made.play()
    learning = made.status.learning
    assert learning.state is LearningState.FAILED
    assert "learned" in learning.reason
    assert not made.pulse("x").enabled


def test_learning_run_of_the_command_line_finishes_the_machine_when_it_is_done(
    stand: Callable[..., LearningStand],
) -> None:
    made = stand(learn=LearningRequest(("y",), "paper"))
    made.services.on_ready()
    assert made.status.learning.axis == "y"
    for _ in STROKES:
        assert made.machine.finished == 0
        made.play()
    assert made.machine.finished == 1
    assert (made.services.completed, made.services.problem) == (True, "")


def test_learning_run_that_fails_finishes_the_machine_and_says_why(
    stand: Callable[..., LearningStand],
) -> None:
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


@pytest.mark.parametrize(
    ("setting", "good", "bad"),
    [
        (Setting.REQUIRED_M, (1e-9, 3.5e-6, 1e-2), (0.0, -1.0, 2e-2, float("nan"), float("inf"))),
        (Setting.LEARNER, (0.0, 1.0, 2.0), (0.5, 3.0, -1.0, float("nan"))),
        (Setting.ADAPTATION, (0.0, 1.0), (0.5, 2.0)),
    ],
)
def test_settings_are_taken_within_their_ranges_only(
    stand: Callable[..., LearningStand], setting: Setting, good: tuple[float, ...], bad: tuple[float, ...]
) -> None:
    made = stand()
    for value in good:
        assert made.desk.change(setting, value).accepted
        assert made.status.settings[setting] == value
    for value in bad:
        assert made.desk.change(setting, value).refusal is Refusal.OUT_OF_RANGE
        assert made.status.settings[setting] == good[-1]


def test_table_of_states_has_no_dead_end_and_asks_nothing_impossible() -> None:
    for state in LearningState:
        reached, open_states = {state}, [state]
        while open_states:
            for after in TRANSITIONS[open_states.pop()].values():
                if after not in reached:
                    reached.add(after)
                    open_states.append(after)
        assert LearningState.DONE in reached
    for state in LearningState:
        if state in {LearningState.RUNNING, LearningState.PAUSING, LearningState.PAUSED}:
            assert following(state, LearningEvent.FAIL) is LearningState.FAILED
            assert following(state, LearningEvent.START) is None


def test_axis_without_a_pulse_cannot_learn(machine_file: Path, tmp_path: Path) -> None:
    text = machine_file.read_text(encoding="utf-8")
    before, _, rest = text.partition("[axis.y.friction_compensation]")
    machine_file.write_text(before + rest[rest.index("[axis.y.disturbance_observer]") :], encoding="utf-8")
    made = LearningStand(machine_file, tmp_path / "learned")
    verdict = made.desk.execute(Request(Command.START_LEARNING, "y"))
    assert (verdict.refusal, verdict.reason) == (
        Refusal.WRONG_STATE,
        "axis y has no friction_compensation section",
    )
    assert made.desk.execute(Request(Command.ENABLE_COMPENSATION, "y")).refusal is Refusal.WRONG_STATE


@pytest.mark.parametrize("section", ["friction_compensation", "disturbance_observer"])
def test_switch_of_what_no_axis_has_is_refused(machine_file: Path, tmp_path: Path, section: str) -> None:
    lines = machine_file.read_text(encoding="utf-8").split("\n\n")
    kept = [part for part in lines if f".{section}]" not in part]
    machine_file.write_text("\n\n".join(kept), encoding="utf-8")
    made = LearningStand(machine_file, tmp_path / "learned")
    pulse = section == "friction_compensation"
    for on in (Command.ENABLE_COMPENSATION, Command.DISABLE_COMPENSATION):
        assert made.desk.execute(Request(on)).accepted is not pulse
    for on in (Command.ENABLE_OBSERVER, Command.DISABLE_OBSERVER):
        assert made.desk.execute(Request(on)).accepted is pulse
    verdict = made.desk.execute(Request(on if not pulse else Command.ENABLE_COMPENSATION))
    assert (verdict.refusal, verdict.reason) == (Refusal.WRONG_STATE, f"no axis has a {section} section")


def test_program_of_the_strokes_is_within_the_limits_from_anywhere(
    stand: Callable[..., LearningStand],
) -> None:
    made = stand()
    made.machine.at_m = [0.09, 0.0]
    assert made.desk.execute(START_X).accepted
    made.machine.program = None
    with pytest.raises(ConfigError, match="beyond the limit"):
        made.motion.prepare_stroke("x", STROKES[0], [0.3, 0.0])


def test_page_on_learning_shows_the_table_of_states() -> None:
    text = (Path(__file__).parents[3] / "docs" / "learning.md").read_text(encoding="utf-8")
    states = [state.name.lower() for state in LearningState]
    lines = [f"| event | {' | '.join(states)} |", "| --- |" + " --- |" * len(states)]
    for event in LearningEvent:
        after = [following(state, event) for state in LearningState]
        lines.append(f"| {event.value} | {' | '.join(a.name.lower() if a else '' for a in after)} |")
    assert "\n".join(lines) in text
