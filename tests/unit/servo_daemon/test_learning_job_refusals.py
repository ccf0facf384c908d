"""Learning, settings and switches that are refused with a reason, before anything moves."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from learning_stand import STROKES, LearningStand

from servo_ctrl.commands.command import Command, CommandRequest, Refusal
from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.commands.stage import Stage
from servo_ctrl.daemon.run.run_options import LearningRequest
from servo_ctrl.errors import ConfigError, ServoCtrlError

START_X = CommandRequest(Command.START_LEARNING, "x")


@pytest.mark.parametrize("stage", [s for s in Stage if s is not Stage.READY])
def test_learning_is_refused_unless_the_machine_is_ready(
    stand: Callable[..., LearningStand], stage: Stage
) -> None:
    made = stand()
    made.machine.stage = stage
    verdict = made.handler.execute(START_X)
    assert verdict.refusal is Refusal.WRONG_STATE
    assert stage.name.lower().replace("_", " ") in verdict.reason
    assert made.status.learning.state is LearningState.IDLE


def test_learning_is_refused_while_learning(stand: Callable[..., LearningStand]) -> None:
    made = stand()
    made.handler.execute(START_X)
    made.play(10)
    verdict = made.handler.execute(CommandRequest(Command.START_LEARNING, "y"))
    assert (verdict.refusal, verdict.reason) == (
        Refusal.WRONG_STATE,
        "learning is running already; abort it first",
    )
    for command in (Command.START_PROGRAM, Command.ROLL_BACK):
        assert made.handler.execute(CommandRequest(command)).refusal is Refusal.WRONG_STATE
    assert made.status.learning.axis == "x"


def test_unknown_axis_and_command_are_refused(stand: Callable[..., LearningStand]) -> None:
    made = stand()
    verdict = made.handler.execute(CommandRequest(Command.START_LEARNING, "z"))
    assert (verdict.refusal, verdict.reason) == (Refusal.UNKNOWN, 'there is no axis "z", only x, y')
    unknown: Any = 99
    assert made.handler.execute(CommandRequest(unknown)).refusal is Refusal.UNKNOWN
    assert made.handler.change(unknown, 1.0).refusal is Refusal.UNKNOWN


def test_strokes_beyond_the_limits_are_refused_before_anything_moves(
    machine_file: Path, tmp_path: Path
) -> None:
    text = machine_file.read_text(encoding="utf-8").replace("radius_mm = 2.0", "radius_mm = 120.0")
    machine_file.write_text(text, encoding="utf-8")
    made = LearningStand(machine_file, tmp_path / "learned")
    verdict = made.handler.execute(START_X)
    assert verdict.refusal is Refusal.OUT_OF_RANGE
    assert "position -120 mm is beyond the limit -100 mm" in verdict.reason
    assert made.machine.program is None
    with pytest.raises(ServoCtrlError, match="position -120 mm is beyond the limit -100 mm"):
        LearningStand(machine_file, tmp_path / "learned", learn=LearningRequest(("x",)))


def test_program_of_the_strokes_is_within_the_limits_from_anywhere(
    stand: Callable[..., LearningStand],
) -> None:
    made = stand()
    made.machine.at_m = [0.09, 0.0]
    assert made.handler.execute(START_X).accepted
    made.machine.program = None
    with pytest.raises(ConfigError, match="beyond the limit"):
        made.motion.prepare_stroke("x", STROKES[0], [0.3, 0.0])


def test_axis_without_a_pulse_cannot_learn(machine_file: Path, tmp_path: Path) -> None:
    text = machine_file.read_text(encoding="utf-8")
    before, _, rest = text.partition("[axis.y.friction_compensation]")
    machine_file.write_text(before + rest[rest.index("[axis.y.disturbance_observer]") :], encoding="utf-8")
    made = LearningStand(machine_file, tmp_path / "learned")
    verdict = made.handler.execute(CommandRequest(Command.START_LEARNING, "y"))
    assert (verdict.refusal, verdict.reason) == (
        Refusal.WRONG_STATE,
        "axis y has no friction_compensation section",
    )
    assert (
        made.handler.execute(CommandRequest(Command.ENABLE_COMPENSATION, "y")).refusal is Refusal.WRONG_STATE
    )


@pytest.mark.parametrize("section", ["friction_compensation", "disturbance_observer"])
def test_switch_of_what_no_axis_has_is_refused(machine_file: Path, tmp_path: Path, section: str) -> None:
    lines = machine_file.read_text(encoding="utf-8").split("\n\n")
    kept = [part for part in lines if f".{section}]" not in part]
    machine_file.write_text("\n\n".join(kept), encoding="utf-8")
    made = LearningStand(machine_file, tmp_path / "learned")
    pulse = section == "friction_compensation"
    for on in (Command.ENABLE_COMPENSATION, Command.DISABLE_COMPENSATION):
        assert made.handler.execute(CommandRequest(on)).accepted is not pulse
    for on in (Command.ENABLE_OBSERVER, Command.DISABLE_OBSERVER):
        assert made.handler.execute(CommandRequest(on)).accepted is pulse
    verdict = made.handler.execute(CommandRequest(on if not pulse else Command.ENABLE_COMPENSATION))
    assert (verdict.refusal, verdict.reason) == (Refusal.WRONG_STATE, f"no axis has a {section} section")


@pytest.mark.parametrize(
    ("setting", "good", "bad"),
    [
        ("required_m", (1e-9, 3.5e-6, 1e-2), (0.0, -1.0, 2e-2, float("nan"), float("inf"))),
        ("learner", ("fast", "paper", "screw"), ("slow", "", 1.0, None)),
        ("adaptation", (False, True), (0.5, 1.0, "on")),
    ],
)
def test_settings_are_taken_within_their_ranges_only(
    stand: Callable[..., LearningStand], setting: str, good: tuple[Any, ...], bad: tuple[Any, ...]
) -> None:
    made = stand()
    for value in good:
        assert made.handler.change(setting, value).accepted
        assert getattr(made.status.settings, setting) == value
    for value in bad:
        assert made.handler.change(setting, value).refusal is Refusal.OUT_OF_RANGE
        assert getattr(made.status.settings, setting) == good[-1]
