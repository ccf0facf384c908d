"""Tunings from the page: on a simulator of their own, never on the machine's bus."""

import asyncio
import inspect
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from servo_ctrl.cli.main import app
from servo_ctrl.cli.tune import tune
from servo_ctrl.commands.local_messages import Requester
from servo_ctrl.daemon.run.report import Pacing
from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.files.tuning_files import LEAST_MS, MOST_MS, USUAL_MS
from servo_ctrl.hmi.shell.program_jobs import JobState
from servo_ctrl.hmi.tuning import page_tunings
from servo_ctrl.hmi.tuning.page_tunings import PageTunings
from servo_ctrl.tuning import simulated
from servo_ctrl.tuning.request import TuneRequest

XY_TABLE = Path(__file__).parents[3] / "machines" / "xy_table" / "controller.toml"
ADA = Requester(user="ada, 'the first'", role="configure", address="192.0.2.7")
SAY_ARGUMENTS = "import sys\nprint('\\n'.join(sys.argv[1:]), flush=True)\n"


@pytest.fixture
def jobs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> PageTunings:
    """Jobs whose program prints its arguments."""
    script = tmp_path / "program.py"
    script.write_text(SAY_ARGUMENTS)
    monkeypatch.setattr(page_tunings, "installed_command", lambda: (sys.executable, str(script)))
    return PageTunings(tmp_path / "jobs")


async def ended_arguments(jobs: PageTunings, axis: str, controller: Path | None = None) -> list[str]:
    """The arguments of the program that was started for an axis, once it has ended."""
    job = await jobs.start(XY_TABLE, axis, 1.6, ADA, controller)
    task = jobs._task
    assert task is not None
    await task
    assert job.state is JobState.DONE
    return job.lines


async def test_the_program_gets_machine_axis_and_ms_and_neither_a_bus_nor_leave_to_apply(
    jobs: PageTunings,
) -> None:
    arguments = await ended_arguments(jobs, "x")
    options = [f"--machine={XY_TABLE}", "--axis=x", "--ms=1.6", "--out"]
    assert arguments == [*options, str(jobs.jobs[0].directory)]


def test_no_name_of_an_axis_is_read_as_an_option(jobs: PageTunings, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[str, str | None]] = []

    async def noted(request: TuneRequest, bus: str | None, _pacing: Pacing) -> None:
        asked.append((request.axis, bus))
        raise ServoCtrlError(request.objection())

    monkeypatch.setattr(simulated, "tune_axis", noted)
    for axis in ("--bus=socketcan:can0", "x --bus socketcan:can0", "--apply"):
        result = CliRunner().invoke(app, ["tune", *asyncio.run(ended_arguments(jobs, axis))])
        assert isinstance(result.exception, ServoCtrlError)
        assert "has no axis" in str(result.exception)
        assert asked.pop() == (axis, None)


def test_a_controller_is_told_the_visitor_who_asked(
    jobs: PageTunings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[object] = []

    async def noted(_request: TuneRequest, socket: Path, who: Requester | None) -> None:
        told.extend((socket, who))
        raise ServoCtrlError("asked")

    monkeypatch.setattr(simulated, "tune_by_controller", noted)
    socket = tmp_path / "page.sock"
    CliRunner().invoke(app, ["tune", *asyncio.run(ended_arguments(jobs, "x", socket))])
    assert told == [socket, ADA]


async def test_without_plant_or_with_an_unusual_ms_nothing_starts(jobs: PageTunings, tmp_path: Path) -> None:
    (tmp_path / "controller.toml").write_text("")
    for machine_file, ms, reason in (
        (tmp_path / "controller.toml", 2.0, r"plant\.toml: there is no such file"),
        (tmp_path / "other.toml", 2.0, r"other\.toml: there is no such file"),
        (XY_TABLE, 0.5, r"Ms 0\.5 is not from 1\.2 to 3"),
        (XY_TABLE, float("nan"), "Ms nan"),
    ):
        with pytest.raises(ServoCtrlError, match=reason):
            await jobs.start(machine_file, "x", ms, ADA)
    assert jobs.jobs == []
    assert not jobs.directory.exists()


def test_the_installed_program_is_servo_ctrl_tune() -> None:
    program, *arguments = page_tunings.installed_command()
    assert (Path(program).name, arguments) == ("servo-ctrl", ["tune", "--progress", "json"])


def test_the_page_offers_the_bounds_of_the_command() -> None:
    ms = inspect.signature(tune).parameters["ms"]
    [option] = ms.annotation.__metadata__
    assert (option.min, option.max, ms.default) == (LEAST_MS, MOST_MS, USUAL_MS)
