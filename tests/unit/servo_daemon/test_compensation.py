"""Active compensation: stored results, switches, invalid files, adaptation."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from learning_stand import STROKES, LearningStand

from servo_ctrl.commands.command import Command, CommandRequest, Refusal
from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.learning.types import Learned

ROLL_BACK_X = CommandRequest(Command.ROLL_BACK, "x")


def learn(made: LearningStand, after_um: float = 1.0) -> LearningStand:
    made.lag_with_pulse_m = after_um * 1e-6
    assert made.handler.execute(CommandRequest(Command.START_LEARNING, "x")).accepted
    for _ in STROKES:
        made.play()
    assert made.status.learning.state is LearningState.DONE
    return made


def test_pulse_is_switched_per_axis_and_for_all(stand: Callable[..., LearningStand]) -> None:
    made = learn(stand())
    table = made.pulse("x").learned
    assert made.handler.execute(CommandRequest(Command.DISABLE_COMPENSATION, "x")).accepted
    assert (made.pulse("x").enabled, made.status.axes[0].compensation_enabled) == (False, False)
    assert made.status.axes[1].compensation_enabled
    assert made.handler.execute(CommandRequest(Command.ENABLE_COMPENSATION)).accepted
    assert made.pulse("x").enabled
    np.testing.assert_array_equal(made.pulse("x").learned, table)
    assert not made.pulse("y").enabled, "nothing learned there yet"


def test_observer_is_switched_per_axis(stand: Callable[..., LearningStand]) -> None:
    made = stand()
    assert made.handler.execute(CommandRequest(Command.ENABLE_OBSERVER, "y")).accepted
    assert [made.servos[name].params.observer.enabled for name in "xy"] == [False, True]
    assert [axis.observer_enabled for axis in made.status.axes] == [False, True]
    made.handler.execute(CommandRequest(Command.DISABLE_OBSERVER))
    assert not made.servos["y"].params.observer.enabled


def test_observer_does_not_disturb_the_strokes_and_acts_again_afterwards(
    stand: Callable[..., LearningStand],
) -> None:
    made = stand()
    made.handler.execute(CommandRequest(Command.ENABLE_OBSERVER, "x"))
    made.handler.execute(CommandRequest(Command.START_LEARNING, "x"))
    assert not made.servos["x"].params.observer.enabled
    made.handler.execute(CommandRequest(Command.PAUSE_LEARNING))
    made.play()
    assert made.servos["x"].params.observer.enabled


@pytest.mark.parametrize(
    ("wanted", "pulse", "observer"),
    [("as configured", True, False), ("off", False, False), ("observer", False, True)],
)
def test_initially_active_compensation_can_be_chosen(
    stand: Callable[..., LearningStand], wanted: str, pulse: bool, observer: bool
) -> None:
    learn(stand())
    made = stand(compensation=wanted)
    assert (made.pulse("x").enabled, made.servos["x"].params.observer.enabled) == (pulse, observer)


def test_enabling_a_pulse_that_was_never_learned_is_an_error(stand: Callable[..., LearningStand]) -> None:
    learn(stand())
    with pytest.raises(ServoCtrlError, match="nothing has been learned for axis y yet"):
        stand(compensation="pulse")


def test_roll_back_takes_the_version_before_and_then_none(stand: Callable[..., LearningStand]) -> None:
    made = learn(learn(stand(), 2.0), 1.0)
    assert made.status.axes[0].version == 2
    assert made.handler.execute(ROLL_BACK_X).accepted
    now = made.status.axes[0]
    assert now.learned is not None
    assert (now.version, now.learned.after_m) == (1, pytest.approx(2e-6, abs=1e-9))
    assert made.machine.notes[-1] == "axis x: rolled back: version 1 is in use"
    assert made.handler.execute(ROLL_BACK_X).accepted
    assert (made.status.axes[0].version, made.pulse("x").enabled) == (0, False)
    verdict = made.handler.execute(ROLL_BACK_X)
    assert (verdict.refusal, verdict.reason) == (Refusal.WRONG_STATE, "no learned functions are in use")


@pytest.mark.parametrize("damage", ["torn", "changed", "other gains"])
def test_invalid_file_is_reported_and_the_axis_runs_without_pulse(
    stand: Callable[..., LearningStand], machine_file: Path, tmp_path: Path, damage: str
) -> None:
    learn(learn(stand(), 2.0), 1.0)
    path = tmp_path / "learned" / "x" / "v0002.json"
    text = path.read_text(encoding="utf-8")
    if damage == "torn":
        path.write_text(text[: len(text) // 2], encoding="utf-8")
    elif damage == "changed":
        path.write_text(text.replace("0.0012", "0.0013"), encoding="utf-8")
    else:
        toml = machine_file.read_text(encoding="utf-8")
        machine_file.write_text(toml.replace("kp_1_s = 38.7", "kp_1_s = 40.0", 1), encoding="utf-8")
    made = stand()
    assert (made.pulse("x").enabled, made.status.axes[0].version) == (False, 0)
    assert made.machine.notes[0].startswith("axis x runs without its learned pulse: ")
    assert "v0002.json" in made.machine.notes[0]
    verdict = made.handler.execute(ROLL_BACK_X)
    assert verdict.accepted, "a roll back is what helps"
    assert made.status.axes[0].version == (0 if damage == "other gains" else 1)


def test_failed_roll_back_is_reported_and_changes_nothing(
    stand: Callable[..., LearningStand], monkeypatch: pytest.MonkeyPatch
) -> None:
    made = learn(stand())

    def fails(_axis: str) -> None:
        raise ServoCtrlError("the disk is gone")

    monkeypatch.setattr(made.services.handler._compensation._learned.pulse_store, "roll_back", fails)
    verdict = made.handler.execute(ROLL_BACK_X)
    assert (verdict.refusal, verdict.reason) == (Refusal.STORAGE, "the disk is gone")
    assert made.status.axes[0].version == 1
    assert made.pulse("x").enabled


def adapting(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every reversal makes all amplitudes larger."""

    def adapted(learned: Learned, *_rest: object) -> Learned:
        return learned._replace(amplitudes=tuple((a, 1.1 * value) for a, value in learned.amplitudes))

    monkeypatch.setattr("servo_ctrl.daemon.learning.adaptation.adapted", adapted)


def reverse(made: LearningStand, times: int = 1) -> None:
    """Production that reverses: sine strokes outside of learning."""
    for _ in range(times):
        slow = STROKES[0]._replace(acceleration_m_s2=0.05)
        made.machine.run(made.motion.prepare_stroke("x", slow, made.machine.set_points_m()))
        made.play()


def test_adaptation_changes_the_functions_in_use_and_stores_them_when_the_run_ends(
    stand: Callable[..., LearningStand], monkeypatch: pytest.MonkeyPatch
) -> None:
    made = learn(stand())
    adapting(monkeypatch)
    reverse(made)
    before = made.status.axes[0]
    assert (before.reversals > 0, before.version) == (True, 1)
    assert made.handler.change("adaptation", True).accepted
    reverse(made)
    now = made.status.axes[0]
    assert now.learned is not None
    assert before.learned is not None
    assert now.learned.amplitudes[0][1] > before.learned.amplitudes[0][1]
    assert made.pulse("x").learned[2, 0] == pytest.approx(now.learned.amplitudes[0][1])
    made.services.learning.adaptation.store()
    assert made.status.axes[0].version == 2
    assert stand().status.axes[0].learned == now.learned
    made.services.learning.adaptation.store()
    assert made.status.axes[0].version == 2, "nothing new, no new version"


def test_adaptation_that_was_rolled_back_is_not_stored(
    stand: Callable[..., LearningStand], monkeypatch: pytest.MonkeyPatch
) -> None:
    made = learn(learn(stand(), 2.0), 1.0)
    adapting(monkeypatch)
    made.handler.change("adaptation", True)
    reverse(made)
    made.handler.execute(ROLL_BACK_X)
    made.services.learning.adaptation.store()
    assert made.status.axes[0].version == 1
    assert stand().status.axes[0].version == 1
