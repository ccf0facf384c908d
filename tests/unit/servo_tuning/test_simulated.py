"""A tuning without a bus: on a simulator of its own, and no broker hears of it."""

import contextlib
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.tuning import simulated
from servo_ctrl.tuning.machine_runs import MachineRuns
from servo_ctrl.tuning.request import TuneRequest

OWN_BUS = "localcan:/somewhere/of/its/own"


class Result(NamedTuple):
    """As much of a TuneResult as is looked at."""

    simulated: bool = False


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> list[tuple[MachineConfig, str]]:
    """Machine and bus of each tuning, none of which is carried out."""
    found: list[tuple[MachineConfig, str]] = []

    class NoRun:
        def __init__(self, request: TuneRequest, runs: MachineRuns) -> None:
            found.append((request.machine, runs.bus))

        async def run(self) -> Result:
            return Result()

    @contextlib.asynccontextmanager
    async def no_simulator(_directory: Path, _pacing: str) -> AsyncIterator[str]:
        yield OWN_BUS

    monkeypatch.setattr(simulated, "TuneRun", NoRun)
    monkeypatch.setattr(simulated, "simulated_machine", no_simulator)
    return found


@pytest.mark.parametrize(("bus", "on"), [(None, OWN_BUS), ("socketcan:can0", "socketcan:can0")])
async def test_only_a_machine_tells_its_broker(
    machines: Path, tmp_path: Path, runs: list[tuple[MachineConfig, str]], bus: str | None, on: str
) -> None:
    machine: Any = load_machine(machines / "xy_table")
    machine = machine.model_copy(update={"mqtt": object()})
    request = TuneRequest(machine, "x", tmp_path, 2.0, None, lambda _: None, lambda _: None)
    result = await simulated.tune_axis(request, bus, "lockstep")
    assert result.simulated == (bus is None)
    assert [(own.mqtt is None, where) for own, where in runs] == [(bus is None, on)]
