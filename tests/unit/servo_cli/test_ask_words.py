"""Arguments of `servo-ctrl ask`: an invalid one is refused in one line, before a bus is opened."""

import sys
from pathlib import Path

import pytest

from servo_ctrl.cli.ask_request import SettingChange, parse_request
from servo_ctrl.cli.main import main
from servo_ctrl.commands.command import Command, CommandRequest
from servo_ctrl.config.load import load_machine

MACHINE = Path(__file__).parents[3] / "machines" / "xy_table"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("learn", '"learn" is not a command; known are start-learning, '),
        ("start-learning now", '"start-learning now" is not a command'),
        ("set", "set: takes one of required-um, learner, adaptation, feed-override-percent"),
        ("set speed 3", "set: takes one of required-um, learner, adaptation, feed-override-percent"),
        ("set required-um nan", 'required-um: "nan" is not a number'),
        ("set required-um 1e999", 'required-um: "1e999" is not a number'),
        ("set learner slow", 'learner: "slow" is none of fast, paper'),
        ("set adaptation 1", 'adaptation: "1" is neither on nor off'),
        ("set adaptation on --axis x", "leave --axis out"),
        ("enable --axis z", '--axis: there is no axis "z"; the machine has x, y'),
        ("status", "bus localcan:/no/such/hub: cannot be opened"),
    ],
)
def test_an_invalid_request_is_refused_before_the_bus_is_opened(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], words: str, message: str
) -> None:
    options = ["--machine", str(MACHINE), "--bus", "localcan:/no/such/hub"]
    monkeypatch.setattr(sys, "argv", ["servo-ctrl", "ask", *options, *words.split()])
    with pytest.raises(SystemExit) as ended:
        main()
    out, err = capsys.readouterr()
    assert (ended.value.code, out, err.count("\n")) == (1, "", 1)
    assert err.startswith("servo-ctrl: ")
    assert message in err


@pytest.mark.parametrize(
    ("words", "axis", "meant"),
    [
        ("start-learning", "", CommandRequest(Command.START_LEARNING)),
        ("roll-back", "y", CommandRequest(Command.ROLL_BACK, "y")),
        ("disable", "x", CommandRequest(Command.DISABLE_COMPENSATION, "x")),
        ("set required-um 3.5", "", SettingChange("required_m", 3.5e-6)),
        ("set learner paper", "", SettingChange("learner", "paper")),
        ("set adaptation off", "", SettingChange("adaptation", False)),
        ("watch", "", "watch"),
    ],
)
def test_words_are_parsed_into_a_request(
    words: str, axis: str, meant: CommandRequest | SettingChange | str
) -> None:
    assert parse_request(words.split(), axis, list(load_machine(MACHINE).axes)) == meant
