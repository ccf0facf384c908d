"""A run ends before its program: by signals, faults, killed processes. All axes stop together."""

import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from forked_program import ForkedProgram
from program_steps import circle

from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.cyclic.cia402 import DriveState, drive_state
from servo_ctrl.daemon.cycle.machine import MachineController
from servo_ctrl.daemon.run.report import Progress, RunReport
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.recording.reader import load_recording

PROGRAM = circle(20.0, 3000.0, turns=200.0)


class Once:
    """Calls `action` at the first progress report of the circle at full speed."""

    def __init__(self, action: Callable[[], object]) -> None:
        self._action: Callable[[], object] | None = action

    def __call__(self, progress: Progress) -> None:
        if self._action is not None and progress.stage is Stage.RUNNING and progress.cycle > 1000:
            action, self._action = self._action, None
            action()


async def run_circle(
    bench: Any, machine_dir: Path, tmp_path: Path, action: Callable[[], object], pacing: Any = "lockstep"
) -> tuple[RunReport, dict[str, np.ndarray]]:
    path = tmp_path / "program.toml"
    path.write_text(PROGRAM, encoding="utf-8")
    machine = load_machine(machine_dir)
    program = load_program(path, machine)
    report = await run_machine(machine, program, bench.bus_spec, pacing, tmp_path / "r", Once(action))
    return report, load_recording(tmp_path / "r").columns


def command_of(columns: dict[str, np.ndarray], name: str) -> np.ndarray:
    """Return a column of both axes (n, 2), of the cycles with set points."""
    both = np.column_stack([columns[f"x.{name}"], columns[f"y.{name}"]])
    return both[np.isfinite(both).all(axis=1)]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
async def test_signal_ramps_all_axes_down_in_step_within_the_limit(
    bench: Any, xy_table: Path, tmp_path: Path, number: signal.Signals
) -> None:
    bench.simulate(xy_table)
    report, columns = await run_circle(bench, xy_table, tmp_path, lambda: os.kill(os.getpid(), number))
    assert (report.completed, report.failed, report.signal) == (False, False, number.name)
    assert report.reason == f"stopped by {number.name}"
    limit_m_s2 = load_machine(xy_table).axes["x"].limits.acceleration_mm_s2 * 1e-3
    speed = command_of(columns, "velocity_command_m_s")
    acceleration = np.diff(speed, axis=0) / 1e-3
    assert np.abs(acceleration).max() <= limit_m_s2 * 1.001
    # both axes come to rest in the same cycle, and the path is straight
    assert not speed[-1].any()
    moving = np.flatnonzero(speed.any(axis=1))
    assert len(speed) - 1 - moving[-1] <= 2
    ramp = speed[moving[-1] - 5 : moving[-1] + 1]
    assert ramp[:, 0] * ramp[0, 1] == pytest.approx(ramp[:, 1] * ramp[0, 0], abs=1e-12)
    for axis in ("x", "y"):
        assert drive_state(int(columns[f"{axis}.statusword"][-1])) is DriveState.SWITCH_ON_DISABLED


EMCY_OVERHEATED = (0x082, bytes.fromhex("1042 09 0000000000"))


async def test_emergency_message_of_one_drive_stops_both_axes(
    bench: Any, xy_table: Path, tmp_path: Path
) -> None:
    bench.simulate(xy_table)
    with bench.monitor() as monitor:
        report, columns = await run_circle(bench, xy_table, tmp_path, lambda: monitor.send(*EMCY_OVERHEATED))
    assert (report.failed, report.completed) == (True, False)
    assert report.reason == (
        "axis.y.drive (node 2): EMCY 4210h, device over-temperature (error register 09h)"
    )
    assert not command_of(columns, "velocity_command_m_s")[-1].any()


async def test_fault_and_end_of_run_are_sent_on_the_bus(bench: Any, xy_table: Path, tmp_path: Path) -> None:
    bench.simulate(xy_table)
    with bench.monitor() as monitor:
        await run_circle(bench, xy_table, tmp_path, lambda: monitor.send(*EMCY_OVERHEATED))
    assert (0x0FF, bytes.fromhex("0010 01 0000000000")) in monitor.frames
    # in the end all nodes are pre-operational, the controller too
    end = [*((0x000, bytes((0x80, node))) for node in (1, 11, 2, 12)), (0x77F, b"\x7f")]
    assert [frame for frame in monitor.frames if frame[0] in {0x000, 0x77F}][-5:] == end


async def test_following_error_makes_the_drives_brake(bench: Any, tmp_path: Path) -> None:
    machine_dir = bench.machine({"following_error_mm = 1.0": "following_error_mm = 0.002"})
    bench.simulate(machine_dir)
    report, columns = await run_circle(bench, machine_dir, tmp_path, lambda: None)
    assert report.failed
    assert report.reason.startswith("axis ")
    assert "following error of" in report.reason
    assert "exceeds 0.002 mm" in report.reason
    for axis in ("x", "y"):
        assert drive_state(int(columns[f"{axis}.statusword"][-1])) is DriveState.SWITCH_ON_DISABLED


@pytest.mark.usefixtures("hub")
async def test_simulator_that_dies_is_noticed_within_the_input_timeout(
    bench: Any, xy_table: Path, tmp_path: Path
) -> None:
    simulator = bench.simulate(xy_table)
    report, columns = await run_circle(bench, xy_table, tmp_path, simulator.kill)
    assert report.failed
    assert report.reason.endswith(": its TPDOs are no longer received")
    assert len(report.events) == 4
    assert len(columns["cycle"]) == report.cycles


@pytest.mark.usefixtures("hub")
async def test_simulator_that_dies_is_noticed_in_real_time(
    bench: Any, xy_table: Path, tmp_path: Path
) -> None:
    simulator = bench.simulate(xy_table, "realtime")
    report, _ = await run_circle(bench, xy_table, tmp_path, simulator.kill, "realtime")
    # By the inputs, or by a computer too busy for real time, perhaps at once: either way the run ends.
    assert report.failed
    assert report.lateness is not None
    assert report.lateness.count > 0


async def test_bus_that_dies_ends_the_run_and_keeps_the_recording(
    bench: Any, hub: ForkedProgram, xy_table: Path, tmp_path: Path
) -> None:
    bench.simulate(xy_table)
    report, columns = await run_circle(bench, xy_table, tmp_path, hub.kill)
    assert report.failed
    assert report.reason.startswith(f"bus {bench.bus_spec} failed: ")
    assert len(columns["cycle"]) > 1000


async def test_an_exception_in_the_cycle_stops_it_and_the_nodes(
    bench: Any, xy_table: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench.simulate(xy_table)
    tick = MachineController.tick

    def buggy(self: MachineController, cycle: int, elapsed: int, inputs: Any) -> list[bytes] | None:
        if cycle == 500:
            raise ZeroDivisionError("a bug")
        return tick(self, cycle, elapsed, inputs)

    monkeypatch.setattr(MachineController, "tick", buggy)
    with bench.monitor() as monitor, pytest.raises(ZeroDivisionError, match="a bug"):
        await run_circle(bench, xy_table, tmp_path, lambda: None)
    assert (0x000, b"\x80\x0c") in monitor.frames
    assert len(load_recording(tmp_path / "r").columns["cycle"]) == 500
