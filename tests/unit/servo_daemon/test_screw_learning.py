"""Learning the screw in the daemon: active compensation meanwhile, storage, and interruption."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from screw_stand import LOST_M, SECTION, TRAVELS, ScrewStand, stage_file

from servo_ctrl.commands.command import Command, CommandRequest, Refusal
from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.config.load import load_machine
from servo_ctrl.daemon.learning.axis_learning import REPEATS, LearningError
from servo_ctrl.daemon.learning.collectors import Collector
from servo_ctrl.daemon.run.services import LearningRequest
from servo_ctrl.learned.store import ScrewStore

START = CommandRequest(Command.START_LEARNING)
Stand = "Callable[..., ScrewStand]"


@pytest.fixture
def stand(tmp_path: Path) -> Callable[..., ScrewStand]:
    def make(*changes: tuple[str, str], **options: object) -> ScrewStand:
        made = ScrewStand(stage_file(tmp_path / "stage", *changes), tmp_path / "learned", **options)
        assert made.handler.change("learner", "screw").accepted
        return made

    return make


def learned(made: ScrewStand) -> ScrewStand:
    assert made.handler.execute(START).accepted
    for _ in range(TRAVELS):
        made.play()
    return made


def test_travels_are_made_without_compensation_and_the_check_with_what_was_learned(
    stand: Callable[..., ScrewStand], tmp_path: Path
) -> None:
    made = stand()
    assert made.params.sampled.enabled
    assert made.handler.execute(START).accepted
    stages = []
    for number in range(TRAVELS):
        learning = made.status.learning
        assert learning.planned
        assert (learning.strokes_done, learning.strokes_total) == (number, TRAVELS)
        stages.append((learning.stage, made.params.screw.enabled, made.params.sampled.enabled))
        made.play()
    assert stages == [("travel", False, False), ("travel", False, False), ("check", True, False)]
    assert made.params.sampled.enabled
    screw = made.status.axes[0].screw
    assert (screw.version, screw.enabled) == (1, True)
    assert screw.learned
    assert screw.lost_motion_m == pytest.approx(LOST_M, abs=2e-8)
    assert screw.before_m > 2e-6
    assert screw.after_m < 5e-8
    assert made.params.screw.table.tolist() == np.array(screw.points).T[:2].tolist()
    assert made.params.take_up.lost_motion_m == screw.lost_motion_m
    stored = json.loads((tmp_path / "learned/x/screw/v0001.json").read_text(encoding="utf-8"))
    assert stored["conditions"]["source"] == "learning"
    [outcome] = made.services.job.outcomes
    assert (outcome.version, outcome.learned.points) == (1, screw.points)
    assert made.machine.notes[-1].startswith("axis x: J 3.0")


def test_the_whole_travel_is_made_at_the_feed(stand: Callable[..., ScrewStand]) -> None:
    made = stand()
    assert made.handler.execute(START).accepted
    made.play()
    command_m = np.array([row[3] for row in made.rows])
    assert (command_m.min(), command_m.max()) == (-6e-3, 6e-3)
    speed_m_s = np.abs(np.diff(command_m)) / 1e-3
    assert np.isclose(speed_m_s[-1000:].max(), 0.02, rtol=1e-6)
    # the first way is to the lower end; the second travel begins there
    begun = len(made.rows)
    made.play()
    assert np.diff(command_m[:100])[-1] < 0.0
    assert [row[3] for row in made.rows[begun : begun + 50]] == [-6e-3] * 50


def test_it_is_used_from_the_start_and_switched_off_with_everything_else(
    stand: Callable[..., ScrewStand],
) -> None:
    table = learned(stand()).params.screw.table.tolist()
    again = stand()
    assert again.params.screw.table.tolist() == table
    off = stand(compensation="off")
    assert (off.params.screw.enabled, off.params.take_up.enabled, off.params.sampled.enabled) == (False,) * 3
    disabled = stand(("[axis.x.screw_compensation]\n", "[axis.x.screw_compensation]\nenabled = false\n"))
    assert not disabled.params.screw.enabled
    assert disabled.handler.execute(CommandRequest(Command.ENABLE_SCREW, "x")).accepted
    assert disabled.params.screw.table.tolist() == table
    assert disabled.handler.execute(CommandRequest(Command.DISABLE_SCREW)).accepted
    assert not disabled.params.screw.enabled
    assert not disabled.params.take_up.enabled


@pytest.mark.parametrize("samples", [10, 700])
def test_abort_keeps_the_old_table(stand: Callable[..., ScrewStand], tmp_path: Path, samples: int) -> None:
    made = learned(stand())
    table = made.params.screw.table.tolist()
    assert made.handler.execute(START).accepted
    made.play()
    made.play(samples)
    assert not made.params.screw.enabled
    assert made.handler.execute(CommandRequest(Command.ABORT_LEARNING)).accepted
    assert made.params.screw.table.tolist() == table
    assert made.params.sampled.enabled
    assert made.status.learning.state is LearningState.ABORTED
    assert made.status.axes[0].screw.version == 1
    assert sorted(path.name for path in (tmp_path / "learned/x/screw").iterdir()) == [
        "active.json",
        "v0001.json",
    ]


def test_fault_keeps_the_old_table(stand: Callable[..., ScrewStand]) -> None:
    made = learned(stand())
    table = made.params.screw.table.tolist()
    assert made.handler.execute(START).accepted
    made.play(300)
    assert not made.params.screw.enabled
    made.stop("a drive has failed")
    assert made.params.screw.table.tolist() == table
    assert made.status.learning.state is LearningState.FAILED


def test_pause_comes_after_the_travel(stand: Callable[..., ScrewStand]) -> None:
    made = stand()
    assert made.handler.execute(START).accepted
    made.play(500)
    assert made.handler.execute(CommandRequest(Command.PAUSE_LEARNING)).accepted
    made.play()
    assert made.status.learning.state is LearningState.PAUSED
    assert made.params.sampled.enabled
    assert made.handler.execute(CommandRequest(Command.RESUME_LEARNING)).accepted
    made.play()
    made.play()
    assert made.status.learning.state is LearningState.DONE


def test_table_that_is_no_better_is_not_used(stand: Callable[..., ScrewStand], tmp_path: Path) -> None:
    made = stand()
    assert made.handler.execute(START).accepted
    made.play()
    made.play()
    learned_error = made.error
    made.error = lambda motor_m: 10.0 * learned_error(motor_m)
    made.play()
    assert made.status.learning.state is LearningState.FAILED
    assert "what was learned is no better and is not used: J is 3.0" in made.status.learning.reason
    assert not made.params.screw.enabled
    assert not (tmp_path / "learned/x/screw").exists()


def test_travel_with_missing_samples_is_repeated_a_bounded_number_of_times(
    stand: Callable[..., ScrewStand], monkeypatch: pytest.MonkeyPatch
) -> None:
    made = stand()
    assert made.handler.execute(START).accepted
    taken = Collector.columns

    def holes(collector: Collector) -> list[np.ndarray]:
        command_m, *others, scale_m = taken(collector)
        return [command_m, *others, np.where(np.abs(command_m) < 1e-3, np.nan, scale_m)]

    monkeypatch.setattr(Collector, "columns", holes)
    for _ in range(REPEATS):
        made.play()
        assert made.machine.notes[-1].startswith(
            "axis x: a travel is made again: on the way up nothing was read"
        )
    made.play()
    assert made.status.learning.state is LearningState.FAILED
    assert "6 travels in a row are spoilt" in made.status.learning.reason


def test_readings_that_cannot_be_used_end_the_run(stand: Callable[..., ScrewStand]) -> None:
    made = stand(("limit_um = 100.0", "limit_um = 5.0"))
    assert made.handler.execute(START).accepted
    made.play()
    made.play()
    assert made.status.learning.state is LearningState.FAILED
    assert "axis x: the correction would be up to 5." in made.status.learning.reason


def test_rolled_back_to_the_version_before(stand: Callable[..., ScrewStand]) -> None:
    made = learned(learned(stand()))
    assert made.status.axes[0].screw.version == 2
    assert made.handler.execute(CommandRequest(Command.ROLL_BACK_SCREW, "x")).accepted
    assert made.status.axes[0].screw.version == 1
    assert made.machine.notes[-1] == "axis x: rolled back: version 1 is in use"
    assert made.handler.execute(CommandRequest(Command.ROLL_BACK_SCREW)).accepted
    assert not made.params.screw.enabled
    verdict = made.handler.execute(CommandRequest(Command.ROLL_BACK_SCREW))
    assert (verdict.refusal, verdict.reason) == (Refusal.WRONG_STATE, "no learned screw is in use")
    # the pulse's versions are others
    assert made.handler.execute(CommandRequest(Command.ROLL_BACK)).reason == "no learned functions are in use"


def test_outdated_result_is_reported_and_not_used(stand: Callable[..., ScrewStand]) -> None:
    learned(stand())
    made = stand(("lead_mm = 5.0", "lead_mm = 10.0"))
    assert not made.params.screw.enabled
    [note] = made.machine.notes
    assert note.startswith("axis x runs without its learned screw: ")
    assert "transmission.lead_mm was 5.0 then, it is 10.0 now; learn axis x again" in note
    assert '"servo-ctrl learned rollback --axis x --kind screw"' in note


def test_no_rolling_back_while_learning(stand: Callable[..., ScrewStand]) -> None:
    made = learned(stand())
    assert made.handler.execute(START).accepted
    for command in (Command.ROLL_BACK_SCREW, Command.START_PROGRAM):
        verdict = made.handler.execute(CommandRequest(command))
        assert verdict == (Refusal.WRONG_STATE, "an axis is learning; pause or abort it first")


def test_axis_without_the_section_is_refused(stand: Callable[..., ScrewStand]) -> None:
    made = stand((SECTION, ""))
    verdict = made.handler.execute(CommandRequest(Command.START_LEARNING, "x"))
    assert verdict == (Refusal.WRONG_STATE, "axis x has no screw_compensation section")
    assert made.handler.execute(START).reason == "no axis has a screw_compensation section"
    assert (
        made.handler.execute(CommandRequest(Command.ENABLE_SCREW)).reason
        == "no axis has a screw_compensation section"
    )
    # nor is there a pulse to be learned here
    assert made.handler.change("learner", "fast").accepted
    assert made.handler.execute(START).reason == "no axis has a friction_compensation section"


def test_feed_beyond_the_limits_is_refused_before_anything_moves(
    stand: Callable[..., ScrewStand], tmp_path: Path
) -> None:
    slow = ("\nvelocity_mm_s = 100.0", "\nvelocity_mm_s = 15.0")
    made = stand(slow)
    verdict = made.handler.execute(START)
    assert verdict.refusal is Refusal.OUT_OF_RANGE
    text = "no travel is possible: axis x: velocity 20 mm/s is beyond the limit 15 mm/s"
    assert text in verdict.reason
    with pytest.raises(LearningError, match="no travel is possible"):
        stand(slow, learn=LearningRequest(("x",), "screw"))
    assert not (tmp_path / "learned").exists()


def test_run_that_learns_ends_when_it_has_learned(stand: Callable[..., ScrewStand], tmp_path: Path) -> None:
    made = stand(learn=LearningRequest((), "screw"))
    made.services.on_ready()
    for _ in range(TRAVELS):
        made.play()
    assert made.services.completed
    assert made.machine.finished == 1
    stored = ScrewStore(tmp_path / "learned", load_machine(tmp_path / "stage")).active("x")
    assert stored is not None
