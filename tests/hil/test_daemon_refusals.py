"""Machines that must not move: missing or wrong nodes, a stop during boot. One line, no power."""

import asyncio
import os
import signal
from pathlib import Path
from typing import Any

import pytest

from servo_ctrl.canopen.errors import BootError
from servo_ctrl.config.load import load_machine
from servo_ctrl.daemon.run.stop_signals import StoppedError
from servo_ctrl.daemon.run.supervisor import run_machine


@pytest.mark.usefixtures("hub")
async def test_absent_nodes_are_named_together_and_nothing_is_started(
    bench: Any, xy_table: Path, tmp_path: Path
) -> None:
    with bench.monitor() as monitor, pytest.raises(BootError) as caught:
        await run_machine(load_machine(xy_table), None, bench.bus_spec, "lockstep", tmp_path / "r")
    assert str(caught.value) == (
        "4 nodes cannot be used: axis.x.drive (node 1), axis.x.scale (node 11), axis.y.drive (node 2), "
        "axis.y.scale (node 12): absent, no answer from 1000h in 10 tries; "
        "check power, cable, bit rate and node id"
    )
    assert (0x000, b"\x80\x01") in monitor.frames
    assert not [can_id for can_id, _ in monitor.frames if can_id == 0x80 or 0x180 <= can_id < 0x580]
    assert not [data for can_id, data in monitor.frames if can_id == 0 and data[0] == 0x01]
    assert not (tmp_path / "r").exists()


async def test_drive_of_another_machine_is_refused(bench: Any, xy_table: Path) -> None:
    """The drive of EMPS has the right identity, but another encoder and other ratings."""
    bench.simulate(xy_table.parent / "emps")
    complaint = r"axis.x.drive \(node 1\): 6075h:00 is 358, the machine file says 1500"
    with bench.monitor() as monitor, pytest.raises(BootError, match=complaint):
        await run_machine(load_machine(xy_table), None, bench.bus_spec, "lockstep")
    assert not [can_id for can_id, _ in monitor.frames if can_id == 0x80 or 0x200 <= can_id < 0x280]


async def test_scale_where_a_drive_should_be_is_a_foreign_node(bench: Any, xy_table: Path) -> None:
    bench.simulate(xy_table)
    swapped = {
        "node_id = 11\n": "node_id = 99\n",
        "node_id = 1\n": "node_id = 11\n",
        "node_id = 99\n": "node_id = 1\n",
    }
    machine_dir = bench.machine(swapped)
    with pytest.raises(BootError) as caught:
        await run_machine(load_machine(machine_dir), None, bench.bus_spec, "lockstep")
    assert "axis.x.drive (node 11): a foreign node: 1000h:00 (device type)" in str(caught.value)
    assert "axis.x.scale (node 1): a foreign node: 1000h:00 (device type)" in str(caught.value)


@pytest.mark.usefixtures("hub")
async def test_signal_during_boot_stops_at_once(bench: Any, xy_table: Path) -> None:
    async def signal_once_it_is_handled() -> None:
        while signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:  # noqa: ASYNC110  # setting it raises no event
            await asyncio.sleep(0.001)
        os.kill(os.getpid(), signal.SIGTERM)

    sent = asyncio.create_task(signal_once_it_is_handled())
    with (
        bench.monitor() as monitor,
        pytest.raises(StoppedError, match="stopped by SIGTERM before anything moved") as stopped,
    ):
        await run_machine(load_machine(xy_table), None, bench.bus_spec, "lockstep")
    await sent
    assert stopped.value.exit_status == 128 + signal.SIGTERM
    assert not [can_id for can_id, _ in monitor.frames if can_id == 0x80]
