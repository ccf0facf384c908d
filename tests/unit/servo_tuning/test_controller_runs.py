"""The runs of a tuning on a controller, with the real local socket and no machine behind it."""

import asyncio
from pathlib import Path
from typing import Any

import pytest
from local_socket_bench import LocalSocketBench

from servo_ctrl.commands.local_messages import Requester
from servo_ctrl.config.load import load_machine
from servo_ctrl.excitation.measuring_motion import TuneError
from servo_ctrl.excitation.tuning_motion import TuningMotion
from servo_ctrl.hmi.link.machine_link import MachineLink
from servo_ctrl.tuning import controller_runs
from servo_ctrl.tuning.controller_runs import ControllerRuns

ANNA = Requester(user="anna", role="operate", address="")
TRIAL = TuningMotion("x", trial=True)


async def record(bench: LocalSocketBench, machine: Any, out: Path) -> Any:
    """What a trial leaves that this controller makes."""
    async with bench.server.serving() as socket:
        link = MachineLink(socket)
        linked = asyncio.create_task(link.run())
        try:
            return await ControllerRuns(link, ANNA, out).record(machine, TRIAL, "before")
        finally:
            linked.cancel()
            await asyncio.gather(linked, return_exceptions=True)


@pytest.mark.parametrize("started_with", ["0" * 64, ""])
async def test_a_controller_of_another_machine_file_is_asked_for_nothing(
    machines: Path, tmp_path: Path, started_with: str
) -> None:
    bench = LocalSocketBench(machine_sha256=started_with)
    with pytest.raises(TuneError, match=r"is not what the controller was started with.*controller\.toml"):
        await record(bench, load_machine(machines / "xy_table"), tmp_path)
    assert bench.tuning_runs == []


async def test_the_controller_of_this_machine_file_makes_the_motion_while_the_program_is_heard(
    machines: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine = load_machine(machines / "xy_table")
    bench = LocalSocketBench(machine_sha256=machine.source_sha256)
    monkeypatch.setattr(controller_runs.shutil, "copytree", lambda _source, _directory: None)
    monkeypatch.setattr(controller_runs, "load_recording", lambda directory: directory)
    monkeypatch.setattr(controller_runs, "HEARTBEAT_S", 0.0)
    bench.tuning_may_end = lambda activity: activity.requests >= 4
    await record(bench, machine, tmp_path)
    assert bench.logged[-1]["do"] == "tuning_run", "heartbeats are not logged"
    assert [asked.axis for asked in bench.tuning_runs] == ["x"]
