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
from servo_ctrl.daemon.learning.axis_learning import REPEATS_MAX, LearningError
from servo_ctrl.daemon.learning.collectors import Collector
from servo_ctrl.daemon.run.run_options import LearningRequest
from servo_ctrl.learned.store import ScrewStore

START = CommandRequest(Command.START_LEARNING)
MakeStand = Callable[..., ScrewStand]
NO_SECTION = "no axis has a screw_compensation section"


@pytest.fixture
def make_stand(tmp_path: Path) -> MakeStand:
    def make(*changes: tuple[str, str], **options: object) -> ScrewStand:
        stand = ScrewStand(stage_file(tmp_path / "stage", *changes), tmp_path / "learned", **options)
        assert stand.handler.change("learner", "screw").accepted
        return stand

    return make


def started(stand: ScrewStand, travels: int = 0) -> ScrewStand:
    """Start to learn, and make that many travels."""
    assert stand.handler.execute(START).accepted
    for _ in range(travels):
        stand.play()
    return stand


def learned(stand: ScrewStand) -> ScrewStand:
    return started(stand, TRAVELS)


def test_travels_run_without_compensation_and_the_check_with_what_was_learned(
    make_stand: MakeStand, tmp_path: Path
) -> None:
    stand = make_stand()
    assert stand.params.sampled.enabled
    assert stand.handler.execute(START).accepted
    stages = []
    for number in range(TRAVELS):
        learning = stand.status.learning
        assert learning.planned
        assert (learning.strokes_done, learning.strokes_total) == (number, TRAVELS)
        stages.append((learning.stage, stand.params.screw.enabled, stand.params.sampled.enabled))
        stand.play()
    assert stages == [("travel", False, False), ("travel", False, False), ("check", True, False)]
    assert stand.params.sampled.enabled
    screw = stand.status.axes[0].screw
    assert (screw.version, screw.enabled) == (1, True)
    assert screw.learned
    assert screw.lost_motion_m == pytest.approx(LOST_M, abs=2e-8)
    assert screw.before_m > 2e-6
    assert screw.after_m < 5e-8
    assert stand.params.screw.table.tolist() == np.array(screw.points).T[:2].tolist()
    assert stand.params.take_up.lost_motion_m == screw.lost_motion_m
    stored = json.loads((tmp_path / "learned/x/screw/v0001.json").read_text(encoding="utf-8"))
    assert stored["conditions"]["source"] == "learning"
    [outcome] = stand.services.learning.job.outcomes
    assert (outcome.version, outcome.learned.points) == (1, screw.points)
    assert stand.machine.notes[-1].startswith("axis x: J 3.0")


def test_the_whole_travel_runs_at_the_feed(make_stand: MakeStand) -> None:
    stand = started(make_stand(), 1)
    command_m = np.array([row[3] for row in stand.rows])
    assert (command_m.min(), command_m.max()) == (-6e-3, 6e-3)
    speed_m_s = np.abs(np.diff(command_m)) / 1e-3
    assert np.isclose(speed_m_s[-1000:].max(), 0.02, rtol=1e-6)
    # the first motion is to the lower end; the second travel begins there
    begun = len(stand.rows)
    stand.play()
    assert np.diff(command_m[:100])[-1] < 0.0
    assert [row[3] for row in stand.rows[begun : begun + 50]] == [-6e-3] * 50


def test_it_is_used_from_the_start_and_switched_off_with_everything_else(make_stand: MakeStand) -> None:
    table = learned(make_stand()).params.screw.table.tolist()
    again = make_stand()
    assert again.params.screw.table.tolist() == table
    off = make_stand(compensation="off")
    assert (off.params.screw.enabled, off.params.take_up.enabled, off.params.sampled.enabled) == (False,) * 3
    disabled = make_stand(("[axis.x.screw_compensation]\n", "[axis.x.screw_compensation]\nenabled = false\n"))
    assert not disabled.params.screw.enabled
    assert disabled.handler.execute(CommandRequest(Command.ENABLE_SCREW, "x")).accepted
    assert disabled.params.screw.table.tolist() == table
    assert disabled.handler.execute(CommandRequest(Command.DISABLE_SCREW)).accepted
    assert not disabled.params.screw.enabled
    assert not disabled.params.take_up.enabled


@pytest.mark.parametrize("samples", [10, 700])
def test_abort_keeps_the_old_table(make_stand: MakeStand, tmp_path: Path, samples: int) -> None:
    stand = learned(make_stand())
    table = stand.params.screw.table.tolist()
    started(stand, 1)
    stand.play(samples)
    assert not stand.params.screw.enabled
    assert stand.handler.execute(CommandRequest(Command.ABORT_LEARNING)).accepted
    assert stand.params.screw.table.tolist() == table
    assert stand.params.sampled.enabled
    assert stand.status.learning.state is LearningState.ABORTED
    assert stand.status.axes[0].screw.version == 1
    stored = {path.name for path in (tmp_path / "learned/x/screw").iterdir()}
    assert stored == {"active.json", "v0001.json"}


def test_fault_keeps_the_old_table(make_stand: MakeStand) -> None:
    stand = learned(make_stand())
    table = stand.params.screw.table.tolist()
    assert stand.handler.execute(START).accepted
    stand.play(300)
    assert not stand.params.screw.enabled
    stand.stop("a drive has failed")
    assert stand.params.screw.table.tolist() == table
    assert stand.status.learning.state is LearningState.FAILED


def test_pause_comes_after_the_travel(make_stand: MakeStand) -> None:
    stand = started(make_stand())
    stand.play(500)
    assert stand.handler.execute(CommandRequest(Command.PAUSE_LEARNING)).accepted
    stand.play()
    assert stand.status.learning.state is LearningState.PAUSED
    assert stand.params.sampled.enabled
    assert stand.handler.execute(CommandRequest(Command.RESUME_LEARNING)).accepted
    stand.play()
    stand.play()
    assert stand.status.learning.state is LearningState.DONE


def test_table_that_is_no_better_is_not_used(make_stand: MakeStand, tmp_path: Path) -> None:
    stand = started(make_stand(), 2)
    learned_error = stand.error
    stand.error = lambda motor_m: 10.0 * learned_error(motor_m)
    stand.play()
    assert stand.status.learning.state is LearningState.FAILED
    assert "what was learned is no better and is not used: J is 3.0" in stand.status.learning.reason
    assert not stand.params.screw.enabled
    assert not (tmp_path / "learned/x/screw").exists()


def test_travel_with_missing_samples_is_repeated_a_bounded_number_of_times(
    make_stand: MakeStand, monkeypatch: pytest.MonkeyPatch
) -> None:
    stand = started(make_stand())
    taken = Collector.columns

    def holes(collector: Collector) -> list[np.ndarray]:
        command_m, *others, scale_m = taken(collector)
        return [command_m, *others, np.where(np.abs(command_m) < 1e-3, np.nan, scale_m)]

    monkeypatch.setattr(Collector, "columns", holes)
    note = "axis x: a travel is repeated: on the travel up nothing was read"
    for _ in range(REPEATS_MAX):
        stand.play()
        assert stand.machine.notes[-1].startswith(note)
    stand.play()
    assert stand.status.learning.state is LearningState.FAILED
    assert "6 consecutive travels are invalid" in stand.status.learning.reason


def test_readings_that_cannot_be_used_end_the_run(make_stand: MakeStand) -> None:
    stand = started(make_stand(("limit_um = 100.0", "limit_um = 5.0")), 2)
    assert stand.status.learning.state is LearningState.FAILED
    assert "axis x: the correction would be up to 5." in stand.status.learning.reason


def test_rolled_back_to_the_version_before(make_stand: MakeStand) -> None:
    stand = learned(learned(make_stand()))
    assert stand.status.axes[0].screw.version == 2
    assert stand.handler.execute(CommandRequest(Command.ROLL_BACK_SCREW, "x")).accepted
    assert stand.status.axes[0].screw.version == 1
    assert stand.machine.notes[-1] == "axis x: rolled back: version 1 is in use"
    assert stand.handler.execute(CommandRequest(Command.ROLL_BACK_SCREW)).accepted
    assert not stand.params.screw.enabled
    verdict = stand.handler.execute(CommandRequest(Command.ROLL_BACK_SCREW))
    assert (verdict.refusal, verdict.reason) == (Refusal.WRONG_STATE, "no learned screw is in use")
    # the pulse's versions are others
    assert (
        stand.handler.execute(CommandRequest(Command.ROLL_BACK)).reason == "no learned functions are in use"
    )


def test_outdated_result_is_reported_and_not_used(make_stand: MakeStand) -> None:
    learned(make_stand())
    stand = make_stand(("lead_mm = 5.0", "lead_mm = 10.0"))
    assert not stand.params.screw.enabled
    [note] = stand.machine.notes
    assert note.startswith("axis x runs without its learned screw: ")
    assert "transmission.lead_mm was 5.0 then, it is 10.0 now; learn axis x again" in note
    assert '"servo-ctrl learned rollback --axis x --kind screw"' in note


def test_no_rolling_back_while_learning(make_stand: MakeStand) -> None:
    stand = learned(make_stand())
    assert stand.handler.execute(START).accepted
    for command in (Command.ROLL_BACK_SCREW, Command.START_PROGRAM):
        verdict = stand.handler.execute(CommandRequest(command))
        assert verdict == (Refusal.WRONG_STATE, "an axis is learning; pause or abort it first")


def test_axis_without_the_section_is_refused(make_stand: MakeStand) -> None:
    stand = make_stand((SECTION, ""))
    verdict = stand.handler.execute(CommandRequest(Command.START_LEARNING, "x"))
    assert verdict == (Refusal.WRONG_STATE, "axis x has no screw_compensation section")
    assert stand.handler.execute(START).reason == NO_SECTION
    assert stand.handler.execute(CommandRequest(Command.ENABLE_SCREW)).reason == NO_SECTION
    # nor is there a pulse to be learned here
    assert stand.handler.change("learner", "fast").accepted
    assert stand.handler.execute(START).reason == "no axis has a friction_compensation section"


def test_feed_beyond_the_limits_is_refused_before_anything_moves(
    make_stand: MakeStand, tmp_path: Path
) -> None:
    slow = ("\nvelocity_mm_s = 100.0", "\nvelocity_mm_s = 15.0")
    stand = make_stand(slow)
    verdict = stand.handler.execute(START)
    assert verdict.refusal is Refusal.OUT_OF_RANGE
    text = "no travel is possible: axis x: velocity 20 mm/s is beyond the limit 15 mm/s"
    assert text in verdict.reason
    with pytest.raises(LearningError, match="no travel is possible"):
        make_stand(slow, learn=LearningRequest(("x",), "screw"))
    assert not (tmp_path / "learned").exists()


def test_run_that_learns_ends_when_it_has_learned(make_stand: MakeStand, tmp_path: Path) -> None:
    stand = make_stand(learn=LearningRequest((), "screw"))
    stand.services.on_ready()
    for _ in range(TRAVELS):
        stand.play()
    assert stand.services.completed
    assert stand.machine.finished == 1
    stored = ScrewStore(tmp_path / "learned", load_machine(tmp_path / "stage")).active("x")
    assert stored is not None
