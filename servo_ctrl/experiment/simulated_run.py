"""One program on a simulated machine, from starting the simulator to the loaded recording."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import TYPE_CHECKING, NamedTuple

from servo_ctrl.config.errors import ServoCtrlError
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.daemon.supervisor import run_machine
from servo_ctrl.experiment.simulated_machine import simulated_machine
from servo_ctrl.telemetry.read import load_recording

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.daemon.report import Progress, RunReport
    from servo_ctrl.telemetry.read import Recording


class RunError(ServoCtrlError):
    """The run did not come to its end."""


class SimulatedRun(NamedTuple):
    """A completed run."""

    machine: MachineConfig
    report: RunReport
    recording: Recording


async def simulated_run(
    machine: Path,
    program: Path,
    out: Path,
    on_progress: Callable[[Progress], None],
    inputs: Mapping[str, Path] | None = None,
) -> SimulatedRun:
    """Run a program file on a machine directory in lockstep; the recording goes into a new folder of `out`.

    Raises:
        ServoCtrlError: whatever kept the program from running to its end.

    """
    config = load_machine(machine)
    motion = load_program(program, config, inputs)
    stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%S.%f")
    directory = out / "recordings" / f"{program.stem}-{stamp}"
    async with simulated_machine(machine, "lockstep") as bus:
        report = await run_machine(config, motion, bus, "lockstep", directory, on_progress)
    if report.failed or not report.completed:
        raise RunError(f"the run was not completed: {report.reason}")
    return SimulatedRun(config, report, load_recording(directory))
