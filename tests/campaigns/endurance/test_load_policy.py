"""Late ticks and a disk that hangs in a whole run are counted and reported, and too many stop the axes.

The clock is scripted and the simulator in lockstep, so that the speed of this computer has no effect.
"""

import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.cyclic.cia402 import DriveState, drive_state
from servo_ctrl.daemon.run import run_recording, session
from servo_ctrl.daemon.run.report import RunReport
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.recording import recorder
from servo_ctrl.recording.reader import load_recording
from tests.campaigns.endurance.rig import MACHINE, Rig, rig, station
from tests.campaigns.endurance.run_counts import compare_counts
from tests.campaigns.endurance.scripted_clock import ScriptedClock

PROGRAM = """
[[step]]
kind = "move"
label = "slowly"
to_mm = { x = 5.0, y = 0.0 }
feed_mm_min = 120.0
"""
ROWS_PER_PART = 40


async def run(table: Rig, directory: Path) -> RunReport:
    machine = load_machine(MACHINE)
    file = directory.with_suffix(".toml")
    file.write_text(PROGRAM, encoding="utf-8")
    return await run_machine(machine, load_program(file, machine), table.bus, "realtime", directory)


@pytest.fixture
def use_clock_script(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[int], int]], None]:
    """Replace the clock by one with this script."""

    def set_script(elapsed: Callable[[int], int]) -> None:
        monkeypatch.setattr(session, "TimerfdClock", lambda _period, on_tick: ScriptedClock(elapsed, on_tick))

    return set_script


GAPS = {700: 5, 800: 11, 900: 21}
"""Periods until the next tick, by cycle: up to the longest gap in which the axes keep their set points."""


async def test_late_ticks_are_counted_and_past_a_set_number_the_axes_are_stopped(
    tmp_path: Path, use_clock_script: Callable[..., None]
) -> None:
    async with rig("lockstep") as table, station("counting_station", str(table.socket)) as observer:
        for name, script, missed, reason in (
            ("few", lambda cycle: GAPS.get(cycle, 1), 4 + 10 + 20, ""),
            ("long", lambda cycle: 22 if cycle == 800 else 1, 21, "21 consecutive ticks were missed"),
            ("half", lambda cycle: 1 + (cycle > 600), 301, "more than 300 of 1000 ticks were missed"),
        ):
            use_clock_script(script)
            await observer.request("begin")
            report = await run(table, tmp_path / name)
            counted = await observer.request("count")
            assert compare_counts(report, counted, tmp_path / name).faults == (), name
            columns = load_recording(tmp_path / name).columns
            assert (report.completed, report.failed) == (not reason, bool(reason)), report.reason
            assert report.reason.startswith(reason)
            if name == "half":
                # every second tick is still missed during the ramp down
                assert report.missed_ticks >= missed
            else:
                assert report.missed_ticks == missed
            assert_ramp_within_limits(columns)


def assert_ramp_within_limits(columns: dict[str, np.ndarray[Any, Any]]) -> None:
    """The ramp is within the acceleration limit, with missed cycles as time, and power is off at its end."""
    controlled = np.isfinite(columns["x.velocity_command_m_s"])
    time_s = columns["time_s"][controlled]
    for axis in ("x", "y"):
        speed_m_s = columns[f"{axis}.velocity_command_m_s"][controlled]
        assert np.abs(np.diff(speed_m_s) / np.diff(time_s)).max() <= 2.0 * 1.001
        assert speed_m_s[-1] == 0.0
        assert drive_state(int(columns[f"{axis}.statusword"][-1])) is DriveState.SWITCH_ON_DISABLED


async def test_disk_that_hangs_costs_rows_that_are_counted_and_never_the_motion(
    tmp_path: Path, use_clock_script: Callable[..., None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A pipe without a reader replaces the third part, so that the writer hangs in the system call."""
    use_clock_script(lambda _cycle: 1)
    monkeypatch.setattr(run_recording, "Recorder", partial(recorder.Recorder, rows_per_part=ROWS_PER_PART))
    monkeypatch.setattr(recorder, "CLOSE_LIMIT_S", 0.2)
    directory = tmp_path / "r"
    directory.mkdir()
    pipe = directory / "part-00002.parquet.tmp"
    os.mkfifo(pipe)
    async with rig("lockstep") as table:
        report = await run(table, directory)
    break_pipe(pipe)
    assert (report.completed, report.failed) == (True, True)
    assert "the disk did not take it within 0.2 s" in report.reason
    columns = load_recording(directory).columns
    assert columns["cycle"].tolist() == list(range(2 * ROWS_PER_PART))
    assert f"({report.cycles - 2 * ROWS_PER_PART} rows lost)" in report.reason


def break_pipe(pipe: Path) -> None:
    """End the thread of the writer: opening and closing the other end breaks the pipe."""
    os.close(os.open(pipe, os.O_RDONLY | os.O_NONBLOCK))
