"""An operator who follows a script between two cycles of a machine that stands by."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pytest

from servo_ctrl.commands.command import Command, CommandRequest
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.load import load_machine
from servo_ctrl.daemon.cycle.machine import MachineController
from servo_ctrl.daemon.run.report import RunReport
from servo_ctrl.daemon.run.services import Services
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.recording.reader import load_recording

Script: TypeAlias = "Generator[Callable[[Operator], bool] | int, None, None]"


class Operator:
    """Acts between two cycles, so that every run is the same.

    A script yields the number of cycles that it waits, or a condition that it waits for.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch, script: Callable[[Operator], Script]) -> None:
        self.cycle = 0
        self.handler: Any = None
        self.machine: Any = None
        self.ended = False
        self._script = script(self)
        self._wait: Callable[[Operator], bool] | int = 0
        self._asked = 0
        begin, tick = Services.begin, MachineController.tick

        def begun(services: Services) -> None:
            begin(services)
            self.handler = services.handler

        def ticked(machine: MachineController, cycle: int, elapsed: int, inputs: Any) -> list[bytes] | None:
            payloads = tick(machine, cycle, elapsed, inputs)
            self.cycle, self.machine = cycle, machine
            self._act()
            return payloads

        monkeypatch.setattr(Services, "begin", begun)
        monkeypatch.setattr(MachineController, "tick", ticked)

    @property
    def status(self) -> MachineStatus:
        status: MachineStatus = self.handler.status()
        return status

    def ask(self, command: Command, axis: str = "") -> str:
        """Give a command; return the reason if it is refused."""
        reason: str = self.handler.execute(CommandRequest(command, axis)).reason
        return reason

    def end(self) -> None:
        """A signal ends the run."""
        os.kill(os.getpid(), signal.SIGTERM)

    def _act(self) -> None:
        self._asked += 1
        assert self._asked < 40_000, "the script waits for what does not come"
        while not self.ended:
            if isinstance(self._wait, int):
                if self._wait > 0:
                    self._wait -= 1
                    return
            elif not self._wait(self):
                return
            try:
                self._wait = next(self._script)
            except StopIteration:
                self.ended = True


def at(stage: Stage) -> Callable[[Operator], bool]:
    return lambda operator: operator.machine.stage is stage


async def operate(
    bench: Any, machine_dir: Path, record: Path, operator: Operator
) -> tuple[RunReport, dict[str, np.ndarray]]:
    async with asyncio.timeout(120.0):
        report = await run_machine(
            load_machine(machine_dir), None, bench.bus_spec, "lockstep", record, stand_by=True
        )
    assert operator.ended
    return report, load_recording(record).columns
