"""Options that `servo-ctrl learn` and `servo-ctrl run` refuse before they open a bus."""

import signal
import sys
from pathlib import Path

import pytest

from servo_ctrl.cli.main import main
from servo_ctrl.daemon.run.stop_signals import StoppedError

MACHINES = Path(__file__).parents[3] / "machines"
NO_BUS = "localcan:/nowhere/at.all"

REFUSED = {
    "axis that is not there": (["learn"], "xy_table", ["--axis", "q"], 'there is no axis "q", only x, y'),
    "axis without a pulse": (["learn"], "emps", [], "no axis has a friction_compensation section"),
    "observer that is not there": (["run"], "emps", ["--observer"], "disturbance_observer"),
    "both at once": (["run"], "xy_table", ["--observer", "--no-compensation"], "exclude each other"),
    "broker that is not an address": (["run"], "xy_table", ["--mqtt", "a b"], "--mqtt"),
    "learner that is unknown": (["learn"], "xy_table", ["--learner", "slow"], "--learner"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_contradictory_options_are_refused_before_the_bus_is_opened(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path, case: str
) -> None:
    command, machine, options, complaint = REFUSED[case]
    place = ["--machine", str(MACHINES / machine), "--bus", NO_BUS, "--learned", str(tmp_path)]
    monkeypatch.setattr(sys, "argv", ["servo-ctrl", *command, *place, *options])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code in {1, 2}
    errors = capsys.readouterr().err
    assert complaint in errors
    assert "nowhere" not in errors
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_before_anything_moved_ends_as_any_other_does(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], number: signal.Signals
) -> None:
    def interrupted() -> None:
        raise StoppedError(number.name)

    monkeypatch.setattr("servo_ctrl.cli.main.app", interrupted)
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 128 + number
    assert capsys.readouterr().err == f"servo-ctrl: stopped by {number.name} before anything moved\n"
