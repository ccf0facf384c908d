"""Invalid user input: one line that names it, exit status 1, and no bus is opened."""

import shutil
import sys
from pathlib import Path

import can
import pytest

from servo_ctrl.cli.main import main

REPOSITORY = Path(__file__).parents[3]
MACHINE = REPOSITORY / "machines" / "xy_table"
NO_BUS = "localcan:/no/such/hub.sock"
MOVE = '[[step]]\nkind = "move"\nlabel = "away"\nto_mm = { x = 10.0 }\nfeed_mm_min = 1000.0\n'
CIRCLE = '[[step]]\nkind = "circle"\nradius_mm = 20.0\nfeed_mm_min = 3000.0\nturns = 1.0\n'

MACHINE_FAULTS = {
    "unknown key": ("[machine]", "[machine]\ncolour = 1", "machine.colour: unknown key"),
    "unknown section": ("[monitoring]", "[monitorin]", "monitorin: unknown key"),
    "missing key": ("sync_period_us = 1000", "", "bus.sync_period_us: is missing"),
    "wrong type": ("sync_period_us = 1000", 'sync_period_us = "1 ms"', "bus.sync_period_us: "),
    "no TOML": ("[machine]", "[machine", "not valid TOML"),
    "negative mass": (
        "acceleration_feedforward_kg = ",
        "acceleration_feedforward_kg = -",
        "acceleration_feedforward_kg",
    ),
    "upper limit below the lower": ("[-100.0, 100.0]", "[100.0, -100.0]", "axis.x.limits.position_mm"),
    "node id twice": ("node_id = 11", "node_id = 1", "node id 1 is already taken by axis.x.drive.node_id"),
    "node id of nobody": ("node_id = 11", "node_id = 200", "axis.x.scale.node_id"),
    "mode that does not exist": ('mode = "cst"', 'mode = "csx"', "axis.x.mode"),
    "set point not mapped": ('"target_torque", ', "", 'axis.x.drive.rpdo1: "target_torque" is missing'),
    "name that the EDS has not": ('"torque_offset"]', '"torque_ofset"]', 'has no object "torque_ofset"'),
    "object we do not compute": ('"torque_offset"]', '"max_torque"]', "not computed by the controller"),
    "EDS that is not there": ("servo_drive.eds", "nosuch.eds", "nosuch.eds: no such EDS file"),
    "EDS of another device": ("servo_drive.eds", "linear_scale.eds", "linear_scale.eds: has no object"),
    "controller without its EDS": ("servo_ctrl.eds", "nosuch.eds", "nosuch.eds: no such EDS file"),
}
PROGRAM_FAULTS = {
    "no such file": (None, "no such file"),
    "no steps": ("", "step: is missing"),
    "unknown kind": (MOVE.replace("move", "jump"), "jump"),
    "unknown key": (MOVE + "speed = 1.0\n", "speed: unknown key"),
    "axis that the machine has not": (MOVE.replace("x =", "z ="), 'has no axis "z"'),
    "beyond the position limit": (
        MOVE.replace("10.0", "100.5"),
        "position 100.5 mm is beyond the limit 100 mm",
    ),
    "beyond the velocity limit": (MOVE.replace("1000.0", "60000.0").replace("10.0", "90.0"), "velocity"),
    "move that takes years": (MOVE.replace("1000.0", "1e-9"), "a step may take 86400 s"),
    "move to infinity, nearly": (MOVE.replace("10.0", "1e308"), "would take inf s"),
    "circle of years": (CIRCLE.replace("turns = 1.0", "turns = 1e300"), "a step may take 86400 s"),
    "circle too fast to be seen": (
        CIRCLE.replace("3000.0", "1e308"),
        "s is shorter than the SYNC period of 0.001 s",
    ),
    "file name with a NUL": (
        '[[step]]\nkind = "samples"\nfile = "a\\u0000b.npz"\nposition = { x = "x" }\n',
        "is not a file name",
    ),
    "circle that does not fit": (MOVE.replace("10.0", "-70.0") + CIRCLE, "position"),
}


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> object:
    """The exit status of the command."""
    monkeypatch.setattr(sys, "argv", ["servo-ctrl", *arguments])
    with pytest.raises(SystemExit) as caught:
        main()
    return caught.value.code


@pytest.fixture(autouse=True)
def no_bus(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing that is refused here may get as far as a bus."""
    monkeypatch.setattr(can, "Bus", lambda **_: pytest.fail("a bus was opened"))


def spoilt_machine(folder: Path, old: str, new: str) -> Path:
    text = (MACHINE / "controller.toml").read_text(encoding="utf-8")
    assert old in text
    shutil.copytree(REPOSITORY / "eds", folder / "eds")
    text = text.replace(old, new, 1).replace("../../eds", "eds")
    (folder / "controller.toml").write_text(text, encoding="utf-8")
    return folder


@pytest.mark.parametrize("command", ["run", "check"])
@pytest.mark.parametrize("fault", MACHINE_FAULTS)
def test_invalid_machine_file_is_refused_in_one_line(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    command: str,
    fault: str,
) -> None:
    old, new, complaint = MACHINE_FAULTS[fault]
    machine = spoilt_machine(tmp_path, old, new)
    bus = ["--bus", NO_BUS] if command == "run" else []
    assert run(monkeypatch, command, "--machine", str(machine), *bus) == 1
    printed = capsys.readouterr()
    assert printed.err.count("\n") == 1
    assert printed.err.startswith("servo-ctrl: ")
    assert complaint in printed.err
    assert "controller.toml" in printed.err
    assert printed.out == ""


@pytest.mark.parametrize("command", ["run", "check"])
@pytest.mark.parametrize("fault", PROGRAM_FAULTS)
def test_invalid_program_is_refused_in_one_line(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    command: str,
    fault: str,
) -> None:
    text, complaint = PROGRAM_FAULTS[fault]
    program = tmp_path / "spoilt.toml"
    if text is not None:
        program.write_text(text, encoding="utf-8")
    bus = ["--bus", NO_BUS] if command == "run" else []
    assert run(monkeypatch, command, "--machine", str(MACHINE), "--program", str(program), *bus) == 1
    printed = capsys.readouterr()
    assert printed.err.count("\n") == 1
    assert complaint in printed.err
    assert "spoilt.toml" in printed.err


def test_machine_directory_without_a_machine_file_is_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert run(monkeypatch, "check", "--machine", str(tmp_path)) == 1
    assert capsys.readouterr().err == f"servo-ctrl: {tmp_path}/controller.toml: no such file\n"


@pytest.mark.parametrize("bus", [NO_BUS, "socketcan:nosuchcan9", "nosuch:can0", "can0"])
def test_bus_that_is_not_there_is_named_in_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], bus: str
) -> None:
    monkeypatch.undo()
    assert run(monkeypatch, "run", "--machine", str(MACHINE), "--bus", bus) == 1
    printed = capsys.readouterr()
    assert printed.err.count("\n") == 1
    assert bus in printed.err
