"""A run beside other controllers: one that is running, one that starts, one that was killed."""

import asyncio
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from forked_program import SERVO_CTRL, ForkedProgram
from program_steps import circle

from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.cyclic.cia402 import DriveState, drive_state
from servo_ctrl.daemon.run.report import Progress
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.io.can_port import BusError
from servo_ctrl.recording.reader import load_recording

START_LIMIT_S = 60.0


@pytest.fixture
def circles(tmp_path: Path) -> Callable[[float], Path]:
    def make(turns: float) -> Path:
        path = tmp_path / f"circle{turns:g}.toml"
        path.write_text(circle(20.0, 3000.0, turns), encoding="utf-8")
        return path

    return make


async def test_second_controller_sends_nothing_and_the_first_goes_on(
    bench: Any, xy_table: Path, circles: Callable[[float], Path]
) -> None:
    bench.simulate(xy_table)
    machine = load_machine(xy_table)
    program = load_program(circles(4.0), machine)
    moving = asyncio.Event()

    def watch(progress: Progress) -> None:
        if progress.label:
            moving.set()

    first = asyncio.create_task(run_machine(machine, program, bench.bus_spec, "lockstep", on_progress=watch))
    await asyncio.wait_for(moving.wait(), START_LIMIT_S)
    with pytest.raises(BusError, match=r"another controller sends .*; only one may run"):
        await run_machine(machine, None, bench.bus_spec, "lockstep")
    report = await first
    assert (report.completed, report.failed) == (True, False)
    assert [event for event in report.events if "learning is due" not in event] == []


async def test_controller_that_comes_in_makes_the_drives_brake(
    bench: Any, xy_table: Path, circles: Callable[[float], Path]
) -> None:
    """Another SYNC producer: the controller has lost control of time and set points."""
    bench.simulate(xy_table)
    machine = load_machine(xy_table)
    program = load_program(circles(100.0), machine)
    with bench.monitor() as monitor:
        sent = False

        def intrude(progress: Progress) -> None:
            nonlocal sent
            if progress.label and not sent:
                sent = True
                monitor.send(0x080, b"")

        report = await run_machine(machine, program, bench.bus_spec, "lockstep", on_progress=intrude)
    assert report.failed
    assert report.reason == f"bus {bench.bus_spec}: another controller sends SYNC; only one may run"


async def test_drives_that_a_killed_controller_left_enabled_brake_before_they_are_homed(
    bench: Any, xy_table: Path, circles: Callable[[float], Path], tmp_path: Path
) -> None:
    """In lockstep time stops with the axes in motion: the next run begins in that state."""
    bench.simulate(xy_table)
    command = [*SERVO_CTRL, "run", "--machine", str(xy_table)]
    command += ["--bus", bench.bus_spec, "--pacing", "lockstep", "--program", str(circles(100.0))]
    first = tmp_path / "killed"
    process = ForkedProgram([*command, "--record", str(first)])
    async with asyncio.timeout(START_LIMIT_S):
        while not (first / "part-00001.parquet").exists():  # noqa: ASYNC110  # files tell nobody
            await asyncio.sleep(0.02)
    process.kill()
    assert process.wait(START_LIMIT_S) == -signal.SIGKILL
    assert process.stdout is not None
    process.stdout.close()
    machine = load_machine(xy_table)
    program = load_program(circles(1.0), machine)
    report = await run_machine(machine, program, bench.bus_spec, "lockstep", tmp_path / "next")
    assert report.completed
    columns = load_recording(tmp_path / "next").columns
    for axis in ("x", "y"):
        states = [drive_state(int(word)) for word in columns[f"{axis}.statusword"]]
        assert states[0] in {DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE}
        taken_over = int(np.flatnonzero(np.isfinite(columns[f"{axis}.position_command_m"]))[0])
        assert DriveState.SWITCH_ON_DISABLED in states[:taken_over]
        speed_m_s = np.abs(np.diff(columns[f"{axis}.motor_position_m"][:taken_over])) / machine.period_s
        assert speed_m_s[0] > 0.0
        assert np.median(speed_m_s[-5:]) < 1e-3  # homing puts the position to zero in one of them
