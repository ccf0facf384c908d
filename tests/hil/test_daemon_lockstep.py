"""The daemon and the simulator in lockstep over the embedded bus: motion, recording and state of a run."""

import asyncio
import json
import os
import signal
from pathlib import Path
from typing import Any

import can
import canopen
import numpy as np
import pytest
from node_client_bus import node_client_bus
from program_steps import circle, move

from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.cyclic.cia402 import DriveState, drive_state
from servo_ctrl.daemon.run.report import Progress, RunReport
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.recording.reader import Recording, load_recording

PROGRAM = move(3.0, -1.0, 1500.0, "out") + circle(2.0, 2000.0, turns=1.25)


@pytest.fixture
def program(tmp_path: Path) -> Path:
    path = tmp_path / "program.toml"
    path.write_text(PROGRAM, encoding="utf-8")
    return path


async def recorded_run(
    bench: Any, machine_dir: Path, program: Path, directory: Path
) -> tuple[RunReport, Recording]:
    machine = load_machine(machine_dir)
    report = await run_machine(machine, load_program(program, machine), bench.bus_spec, "lockstep", directory)
    return report, load_recording(directory)


async def test_program_is_run_and_recorded_from_end_to_end(
    bench: Any, xy_table: Path, program: Path, tmp_path: Path
) -> None:
    bench.simulate(xy_table)
    report, recording = await recorded_run(bench, xy_table, program, tmp_path / "r")
    columns = recording.columns
    assert (report.completed, report.failed, report.reason, report.events) == (True, False, "", ())
    assert columns["cycle"].tolist() == list(range(report.cycles))
    assert columns["time_s"].tolist() == [cycle * 0.001 for cycle in range(report.cycles)]
    header = json.loads((tmp_path / "r" / "recording.json").read_text(encoding="utf-8"))
    assert header["finished"]
    assert header["completed"]
    for index, span in enumerate(report.spans):
        rows = columns["cycle"][columns["segment"] == index]
        assert (rows[0], rows[-1], len(rows)) == (span.first_cycle, span.last_cycle, rows[-1] - rows[0] + 1)
    moving = columns["segment"] >= 0
    for axis in ("x", "y"):
        states = {drive_state(int(word)) for word in columns[f"{axis}.statusword"][moving]}
        assert states == {DriveState.OPERATION_ENABLED}
        assert np.abs(columns[f"{axis}.position_error_m"][moving]).max() < 200e-6
        assert drive_state(int(columns[f"{axis}.statusword"][-1])) is DriveState.SWITCH_ON_DISABLED
    out = recording.segment("out")
    assert out["x.scale_position_m"][-1] == pytest.approx(3e-3, abs=20e-6)
    assert out["y.scale_position_m"][-1] == pytest.approx(-1e-3, abs=20e-6)


async def test_two_runs_are_the_same_bit_for_bit(
    bench: Any, xy_table: Path, program: Path, tmp_path: Path
) -> None:
    recordings = []
    for name in ("a", "b"):
        simulator = bench.simulate(xy_table)
        recordings.append((await recorded_run(bench, xy_table, program, tmp_path / name))[1].columns)
        simulator.terminate()
        simulator.wait(timeout=10.0)
    first, second = recordings
    for name, column in first.items():
        np.testing.assert_array_equal(column, second[name], err_msg=name)


async def test_machine_can_be_run_again_without_restarting_its_nodes(
    bench: Any, xy_table: Path, program: Path, tmp_path: Path
) -> None:
    bench.simulate(xy_table)
    for name in ("a", "b"):
        report, _ = await recorded_run(bench, xy_table, program, tmp_path / name)
        assert (report.completed, report.reason) == (True, "")


async def test_controller_node_shows_its_state_to_a_third_party(bench: Any, xy_table: Path) -> None:
    """A client of canopen at a machine without a program, which holds its position."""
    bench.simulate(xy_table)
    bus = node_client_bus(bench.bus_spec, 127)
    client = canopen.Network(bus)
    notifier = can.Notifier(bus, client.listeners, 0.02)
    node = client.add_node(127, str(xy_table.parents[1] / "eds" / "servo_ctrl.eds"))
    answers: list[Any] = []
    states: list[int] = []
    node.nmt.add_heartbeat_callback(states.append)
    asked = asyncio.Event()

    def on_progress(progress: Progress) -> None:
        if progress.stage is Stage.READY:
            asked.set()

    async def ask_and_stop() -> None:
        await asyncio.wait_for(asked.wait(), 60.0)
        answers.extend(await asyncio.to_thread(ask, node))
        os.kill(os.getpid(), signal.SIGTERM)

    async with asyncio.TaskGroup() as group:
        group.create_task(ask_and_stop())
        report = await run_machine(
            load_machine(xy_table), None, bench.bus_spec, "lockstep", None, on_progress
        )
    notifier.stop(timeout=2.0)
    bus.shutdown()
    state, cycles, product = answers
    assert (Stage(state), product) == (Stage.READY, 0x53435452)
    assert cycles > 0
    assert {0, 127, 5} <= set(states)
    assert (report.signal, report.failed) == ("SIGTERM", False)


def ask(node: Any) -> list[int]:
    """Return state, cycles and product code, read by SDO."""
    return [node.sdo[0x2000].raw, node.sdo[0x2002].raw, node.sdo[0x1018][2].raw]
