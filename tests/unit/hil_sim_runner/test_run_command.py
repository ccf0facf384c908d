"""`hil-sim run`: its help, and one line for every error."""

import os
from pathlib import Path

import pytest
from in_process_nodes import EDS, IDEAL_AXIS
from typer.testing import CliRunner

from hil_sim.cli.main import app

NOWHERE = "localcan:/nonexistent/bus.sock"


def plant(directory: Path, **replacements: str) -> Path:
    """A copy of the ideal axis with texts replaced, its EDS paths absolute."""
    text = IDEAL_AXIS.read_text(encoding="utf-8").replace("../../eds", str(EDS))
    for old, new in replacements.values():
        assert old in text
        text = text.replace(old, new, 1)
    file = directory / "plant.toml"
    file.write_text(text, encoding="utf-8")
    return file


def refused(*arguments: str) -> str:
    """Assert that the command fails with one line; return the line."""
    result = CliRunner().invoke(app, ["run", *arguments])
    assert result.exit_code == 1, result.output
    (line,) = result.stderr.splitlines()
    assert line.startswith("hil-sim: ")
    return line


def test_help_shows_an_example_and_every_option() -> None:
    result = CliRunner().invoke(app, ["run", "--help"], env={"COLUMNS": "200", "TERM": "dumb"})
    assert result.exit_code == 0
    for word in ("--machine", "--bus", "--pacing", "--state-dir", "lockstep", "Example"):
        assert word in result.output
    assert CliRunner().invoke(app, ["--help"]).exit_code == 0


@pytest.mark.parametrize(
    ("bus", "reason"),
    [
        (NOWHERE, "cannot be opened"),
        ("socketcan", "INTERFACE:CHANNEL"),
        ("socketcan:", "INTERFACE:CHANNEL"),
        ("nonsense:x", "cannot be opened"),
        ("virtual:x", "cannot be waited on"),
    ],
)
def test_a_bus_that_is_not_there_is_named(bus: str, reason: str) -> None:
    line = refused("--machine", str(IDEAL_AXIS), "--bus", bus)
    assert reason in line
    assert bus.partition(":")[2] in line


def test_a_simulation_in_lockstep_restores_the_scheduling_policy_at_its_end() -> None:
    before = os.sched_getscheduler(0)
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    try:
        refused("--machine", str(IDEAL_AXIS), "--bus", "virtual:x")
        assert os.sched_getscheduler(0) == os.SCHED_OTHER
    finally:
        os.sched_setscheduler(0, before, os.sched_param(0))


def test_a_machine_that_is_not_there_is_named(tmp_path: Path) -> None:
    assert "plant.toml" in refused("--machine", str(tmp_path), "--bus", NOWHERE)


def test_an_unknown_key_is_named_before_the_bus_is_opened(tmp_path: Path) -> None:
    file = plant(tmp_path, typo=("mass_kg = 40.0", "mass_kg = 40.0\nmas_kg = 1.0"))
    line = refused("--machine", str(file), "--bus", NOWHERE)
    assert "mas_kg" in line
    assert str(file) in line


def test_duplicate_node_ids_are_refused(tmp_path: Path) -> None:
    file = plant(tmp_path, scale=("node_id = 11", "node_id = 1"))
    assert "node id 1 is used twice" in refused("--machine", str(file), "--bus", NOWHERE)


@pytest.fixture
def open_bus(monkeypatch: pytest.MonkeyPatch) -> str:
    """A bus that can be opened and polled, and has no frames."""
    import socket  # noqa: PLC0415  # only for this stand-in

    class Silent:
        channel_info = "silent"

        def __init__(self) -> None:
            self.ends = socket.socketpair()

        def fileno(self) -> int:
            return self.ends[0].fileno()

        def shutdown(self) -> None:
            for end in self.ends:
                end.close()

    monkeypatch.setattr("hil_sim.runner.can_port.open_bus", lambda _address: Silent())
    return "silent:x"


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("absent.eds", None, "No such file"),
        ("text.eds", "this is not an EDS", "no usable EDS"),
        ("scale.eds", "linear_scale.eds", "object 2010h:01 is missing"),
    ],
)
def test_a_wrong_eds_is_named(
    tmp_path: Path, open_bus: str, name: str, content: str | None, reason: str
) -> None:
    eds = tmp_path / name
    if content is not None:
        source = EDS / content
        eds.write_text(source.read_text(encoding="ascii") if source.exists() else content, encoding="ascii")
    file = plant(tmp_path, eds=(str(EDS / "servo_drive.eds"), str(eds)))
    line = refused("--machine", str(file), "--bus", open_bus)
    assert str(eds) in line
    assert "axis.x.drive.eds" in line
    assert reason in line


def test_the_eds_of_another_profile_is_refused(tmp_path: Path, open_bus: str) -> None:
    eds = tmp_path / "other.eds"
    text = (EDS / "servo_drive.eds").read_text(encoding="ascii").replace("0x00020192", "0x00020191")
    eds.write_text(text, encoding="ascii")
    file = plant(tmp_path, eds=(str(EDS / "servo_drive.eds"), str(eds)))
    assert "device profile 401, not 402" in refused("--machine", str(file), "--bus", open_bus)
