"""Tuning on a bus, or on a simulated machine where no bus is named."""

from collections.abc import Callable
from pathlib import Path

from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.run.report import Pacing, Progress
from servo_ctrl.hil_rig.simulated_machine import simulated_machine
from servo_ctrl.tuning.session import TuneResult, TuneRun


async def tuned(
    machine: MachineConfig,
    axis: str,
    bus: str | None,
    pacing: Pacing,
    out: Path,
    *,
    ms: float,
    force_n: float | None,
    show: Callable[[Progress], None],
    tell: Callable[[str], None],
) -> TuneResult:
    """Tune an axis. Raises TuneError, and what any run raises."""

    def run_on(spec: str, pace: Pacing) -> TuneRun:
        return TuneRun(machine, axis, spec, pace, out, ms=ms, force_n=force_n, show=show, tell=tell)

    if bus is not None:
        return await run_on(bus, pacing).run()
    run_on("localcan:none", "lockstep")  # objections before the simulator starts
    tell("starting hil-sim (the first start compiles the kernels) ...")
    async with simulated_machine(machine.source.parent, "lockstep") as spec:
        return await run_on(spec, "lockstep").run()
