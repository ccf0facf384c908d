"""A run with the local socket: a page monitors and commands a simulated table over the real bus."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from operated_table import operated
from program_steps import circle

from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.load import load_machine
from servo_ctrl.daemon.page.page_process import PageOptions
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.io.can_port import BusError
from servo_ctrl.recording.reader import load_recording

PROGRAM = circle(5.0, 3000.0, turns=0.75)
FOLLOWING_ERROR_TIME, CONTROLWORD, HEARTBEAT, DEVICE_NAME = 0x6066, 0x6040, 0x1017, 0x1008


async def test_page_sees_the_run_as_it_is_recorded(bench: Any, tmp_path: Path) -> None:
    async with operated(bench, tmp_path, PROGRAM, serve=True) as table:
        await table.until(lambda status: status.stage is Stage.READY and status.program.progress == 1.0)
        # where lockstep time stood still, rates are those of the wall clock until their next update. What is
        # awaited here is read below, without an update in between
        await table.until(
            lambda status: (
                status.bus.frames_per_s >= 7000.0
                and status.bus.load > 0.6
                and {reversal.axis for reversal in table.link.reversals} == {"x", "y"}
            )
        )
        status, hello, link = table.link.status, table.link.hello, table.link
        await table.stop()
    assert hello is not None
    assert [axis.name for axis in hello.axes] == ["x", "y"]
    assert (status.bus.missed_ticks, status.bus.missing_inputs) == (0, 0)
    # seven in a cycle, and those sent by the wall clock: on a slow machine there are more of them in a cycle
    assert status.bus.frames_per_s >= 7000.0
    assert status.bus.load > 0.6
    assert sum(status.bus.cycle_us.counts) >= status.cycles - 100
    assert {node.nmt_state for node in status.nodes} == {"operational"}
    assert status.rows_missed == 0
    assert {reversal.axis for reversal in link.reversals} == {"x", "y"}
    recording = load_recording(tmp_path / "r")
    reversal = link.reversals[0]
    # the trace is the error at the table from t1 on, positive = lagging: computed again from the recording
    axis, start = reversal.axis, reversal.report.cycle
    error = recording.columns[f"{axis}.position_command_m"] - recording.columns[f"{axis}.scale_position_m"]
    first = int(np.searchsorted(recording.columns["cycle"], start))
    window = error[first : first + len(reversal.error_m)] * reversal.report.direction
    np.testing.assert_allclose(np.array(reversal.error_m, dtype=float), window, atol=2e-9)
    cycles = link.rows.column("cycle")
    kept = recording.columns["cycle"][-len(cycles) :]
    begin = int(np.searchsorted(recording.columns["cycle"], cycles[0]))
    np.testing.assert_array_equal(recording.columns["cycle"][begin : begin + len(cycles)], cycles)
    for name in ("x.position_command_m", "y.scale_position_m", "x.statusword"):
        seen, written = link.rows.column(name), recording.columns[name][begin : begin + len(cycles)]
        np.testing.assert_array_equal(seen, written.astype(float))
    assert len(kept)


async def test_page_commands_the_machine_and_its_nodes_but_no_cyclic_objects(
    bench: Any, tmp_path: Path
) -> None:
    async with operated(bench, tmp_path, PROGRAM, serve=True) as table:
        await table.until(lambda status: status.stage is Stage.RUNNING)
        refused = await table.ask("write_object", node=1, index=FOLLOWING_ERROR_TIME, value=20)
        assert (refused.refusal, "running" in refused.reason) == ("wrong_state", True)
        await table.until(lambda status: status.stage is Stage.READY and status.program.progress == 1.0)
        name = await table.ask("read_object", node=1, index=DEVICE_NAME)
        assert isinstance(name.value, str)
        assert len(name.value) > 8, "more than one segment"
        assert (await table.ask("write_object", node=1, index=FOLLOWING_ERROR_TIME, value=20)).accepted
        assert (await table.ask("read_object", node=1, index=FOLLOWING_ERROR_TIME)).value == 20
        for index, value, refusal in (
            (CONTROLWORD, 0, "wrong_state"),
            (HEARTBEAT, 0, "wrong_state"),
            (DEVICE_NAME, "x", "wrong_state"),
            (FOLLOWING_ERROR_TIME, 70_000, "out_of_range"),
            (FOLLOWING_ERROR_TIME, 1.5, "out_of_range"),
            (FOLLOWING_ERROR_TIME, "much", "out_of_range"),
            (0x5FFF, 0, "unknown"),
        ):
            answer = await table.ask("write_object", node=1, index=index, value=value)
            assert (answer.accepted, answer.refusal) == (False, refusal), answer
        assert (await table.ask("read_object", node=99, index=0x1000)).refusal == "unknown"
        wrong = PROGRAM.replace("radius_mm", "radius")
        answer = await table.ask("load_program", program={"name": "mine.toml", "text": wrong})
        assert (answer.accepted, answer.refusal) == (False, "out_of_range")
        assert answer.reason.startswith('mine.toml: step[1] "round".radius_mm')
        answer = await table.ask("load_program", program={"name": "mine.ngc", "text": "G0 X1 Q9\n"})
        assert answer.reason.startswith("mine.ngc: ")
        before = sum(table.link.status.bus.cycle_us.counts)
        assert (await table.ask("clear_counters")).accepted
        await table.until(lambda status: sum(status.bus.cycle_us.counts) < before)
        assert (await table.ask("command", command="start_program")).accepted
        await table.until(lambda status: status.stage is Stage.RUNNING)
        assert (await table.ask("command", command="start_program")).refusal == "wrong_state"
        report = await table.stop()
    assert not report.failed
    lines = [json.loads(line) for line in (tmp_path / "r" / "commands.jsonl").read_text().splitlines()]
    assert [line["accepted"] for line in lines].count(True) == 5
    assert {line["user"] for line in lines} == {"anna"}
    assert any("anna (configure, 192.0.2.7): write 6066h:00 of node 1" in event for event in report.events)


async def test_a_run_without_a_bus_ends_with_its_reason_and_removes_its_socket(
    bench: Any, tmp_path: Path
) -> None:
    machine, paths = load_machine(bench.machine({})), []
    page = PageOptions(None, paths.append)
    with pytest.raises(BusError):
        await run_machine(machine, None, "localcan:/none", "lockstep", page=page, learned_dir=tmp_path)
    assert paths
    assert not paths[0].parent.exists()
