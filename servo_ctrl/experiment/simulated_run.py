"""One program on a simulated machine, from starting the simulator to the loaded recording."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from servo_ctrl.config.errors import ServoCtrlError
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.daemon.supervisor import run_machine
from servo_ctrl.experiment.simulated_machine import simulated_machine
from servo_ctrl.telemetry.read import load_recording

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.config.program_model import ProgramConfig
    from servo_ctrl.daemon.compensation import Compensation
    from servo_ctrl.daemon.page_process import PageOptions
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
    program: Path | ProgramConfig,
    out: Path,
    on_progress: Callable[[Progress], None],
    inputs: Mapping[str, Path] | None = None,
    *,
    compensation: Compensation = "off",
    learned: Path | None = None,
    page: PageOptions | None = None,
) -> SimulatedRun:
    """Run a program on a machine directory in lockstep; the recording goes into a new folder of `out`.

    `learned` is the directory of the functions that act with "pulse" or "as configured", `page` shows the run
    to an operator.

    Raises:
        ServoCtrlError: whatever kept the program from running to its end.

    """
    config = load_machine(machine)
    motion = load_program(program, config, inputs) if isinstance(program, Path) else program
    directory = new_recording(out, motion.source.stem)
    async with simulated_machine(machine, "lockstep") as bus:
        report = await run_machine(
            config,
            motion,
            bus,
            "lockstep",
            directory,
            on_progress,
            learned_dir=learned,
            compensation=compensation,
            page=page,
        )
    if report.failed or not report.completed:
        raise RunError(f"the run was not completed: {report.reason}")
    return SimulatedRun(config, report, load_recording(directory))


def new_recording(out: Path, name: str) -> Path:
    """Where the recording of a run that begins now goes."""
    stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%S.%f")
    return out / "recordings" / f"{name}-{stamp}"
