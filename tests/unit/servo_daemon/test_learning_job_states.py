"""Learning through all its states, on a fake machine: pauses, aborts, faults, restarts."""

from collections.abc import Callable
from pathlib import Path

import pytest
from learning_stand import PULSE, STROKES, LearningStand, learned_once

from servo_ctrl.commands.command import Command, CommandRequest
from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.commands.stage import Stage
from servo_ctrl.daemon.learning.learning_states import TRANSITIONS, LearningEvent, following
from servo_ctrl.daemon.run.run_options import LearningRequest

START_X = CommandRequest(Command.START_LEARNING, "x")


def test_pause_ends_the_present_stroke_and_resume_goes_on(stand: Callable[..., LearningStand]) -> None:
    made = stand()
    made.handler.execute(START_X)
    made.play(20)
    assert made.handler.execute(CommandRequest(Command.PAUSE_LEARNING)).accepted
    assert made.status.learning.state is LearningState.PAUSING
    made.play()
    assert (made.status.learning.state, made.machine.stage) == (LearningState.PAUSED, Stage.READY)
    assert not made.pulse("x").enabled
    assert made.handler.execute(CommandRequest(Command.RESUME_LEARNING)).accepted
    for _ in STROKES[1:]:
        made.play()
    assert made.status.learning.state is LearningState.DONE


def test_resume_before_the_pause_begins_cancels_it(stand: Callable[..., LearningStand]) -> None:
    made = stand()
    made.handler.execute(START_X)
    made.handler.execute(CommandRequest(Command.PAUSE_LEARNING))
    assert made.handler.execute(CommandRequest(Command.RESUME_LEARNING)).accepted
    for _ in STROKES:
        made.play()
    assert made.status.learning.state is LearningState.DONE


def test_abort_ramps_down_and_forgets_the_strokes_but_keeps_the_functions_in_use(
    stand: Callable[..., LearningStand], tmp_path: Path
) -> None:
    made = learned_once(stand())
    table = made.pulse("x").learned
    made.handler.execute(START_X)
    made.play()
    made.play(20)
    assert made.pulse("x").learned[1:, 0].tolist() == list(PULSE)
    assert made.handler.execute(CommandRequest(Command.ABORT_LEARNING)).accepted
    assert (made.machine.interrupted, made.status.learning.state) == (1, LearningState.ABORTED)
    assert made.pulse("x").learned is table
    made.rest()
    assert made.status.learning.state is LearningState.ABORTED
    assert not (tmp_path / "learned" / "x" / "journal.jsonl").exists()
    assert made.status.axes[0].version == 1
    assert made.handler.execute(START_X).accepted
    learning = made.status.learning
    assert learning.planned
    assert learning.strokes_done == 0


def test_fault_keeps_the_functions_in_use_and_the_strokes_for_the_next_run(
    stand: Callable[..., LearningStand],
) -> None:
    made = learned_once(stand())
    table = made.pulse("x").learned
    made.handler.execute(START_X)
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
    following_run.handler.execute(START_X)
    learning = following_run.status.learning
    assert learning.planned
    assert learning.strokes_done == 2
    assert following_run.machine.notes == ["axis x: learning goes on after 2 strokes made before"]


def test_run_that_was_killed_and_resumed_learns_the_very_same(
    stand: Callable[..., LearningStand], machine_file: Path, tmp_path: Path
) -> None:
    whole = learned_once(LearningStand(machine_file, tmp_path / "whole")).status.axes[0].learned
    torn = stand()
    torn.handler.execute(START_X)
    torn.play()
    torn.play(33)  # and it ends there
    resumed = stand()
    resumed.handler.execute(START_X)
    for _ in STROKES[1:]:
        resumed.play()
    assert resumed.status.axes[0].learned == whole
    assert resumed.services.learning.job.outcomes[0].resumed == 1


def test_fresh_start_discards_the_journal(stand: Callable[..., LearningStand]) -> None:
    begun = stand()
    begun.handler.execute(START_X)
    begun.play()
    made = stand(learn=LearningRequest(("x",), fresh=True))
    made.services.on_ready()
    learning = made.status.learning
    assert learning.planned
    assert learning.strokes_done == 0


def test_journal_of_other_strokes_is_not_resumed(
    stand: Callable[..., LearningStand], monkeypatch: pytest.MonkeyPatch
) -> None:
    begun = stand()
    begun.handler.execute(START_X)
    begun.play()
    other = STROKES[0]._replace(acceleration_m_s2=0.85)
    monkeypatch.setattr("learning_stand.STROKES", (other, *STROKES[1:]))
    made = stand()
    made.handler.execute(START_X)
    assert made.machine.notes[0].endswith("other strokes than would be made now; learning starts again")
    learning = made.status.learning
    assert learning.planned
    assert learning.strokes_done == 0


def test_table_of_states_has_no_dead_end_and_no_impossible_action() -> None:
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


def test_page_on_learning_shows_the_table_of_states() -> None:
    text = (Path(__file__).parents[3] / "docs" / "learning.md").read_text(encoding="utf-8")
    states = [state.name.lower() for state in LearningState]
    lines = [f"| event | {' | '.join(states)} |", "| --- |" + " --- |" * len(states)]
    for event in LearningEvent:
        after = [following(state, event) for state in LearningState]
        lines.append(f"| {event.value} | {' | '.join(a.name.lower() if a else '' for a in after)} |")
    assert "\n".join(lines) in text
