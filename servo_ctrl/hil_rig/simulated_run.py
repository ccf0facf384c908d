"""One program on a simulated machine, from starting the simulator to the loaded recording."""

import asyncio
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

from servo_ctrl.canopen.plan import plan_machine
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.program_model import ProgramConfig
from servo_ctrl.daemon.learning.learned_compensation import Compensation
from servo_ctrl.daemon.page.page_process import PageOptions
from servo_ctrl.daemon.run.assemble import build_axes
from servo_ctrl.daemon.run.report import Progress, RunReport
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.hil_rig.simulated_machine import simulated_machine
from servo_ctrl.recording.reader import Recording, load_recording


class RunError(ServoCtrlError):
    """The run ended early."""


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
    plans = plan_machine(config)
    # A first start compiles kernels on both sides, ten seconds each: ours while hil-sim compiles its own.
    kernels = asyncio.create_task(asyncio.to_thread(build_axes, config, plans))
    try:
        async with simulated_machine(machine, "lockstep") as bus:
            await kernels
            report = await run_machine(
                config,
                motion,
                bus,
                pacing="lockstep",
                record_dir=directory,
                on_progress=on_progress,
                learned_dir=learned,
                compensation=compensation,
                page=page,
            )
    finally:
        await asyncio.gather(kernels, return_exceptions=True)
    if report.failed or not report.completed:
        raise RunError(f"the run was not completed: {report.reason}")
    return SimulatedRun(config, report, load_recording(directory))


def new_recording(out: Path, name: str) -> Path:
    """Return a new directory of `out` for the recording of a run that begins now."""
    stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%S.%f")
    return out / "recordings" / f"{name}-{stamp}"


async def simulated_standby(
    machine: Path, page: PageOptions, on_progress: Callable[[Progress], None]
) -> None:
    """Keep a machine directory in standby, in real time, for the operator's page, until a signal."""
    config = load_machine(machine)
    async with simulated_machine(machine, "realtime") as bus:
        await run_machine(config, None, bus, on_progress=on_progress, stand_by=True, page=page)
