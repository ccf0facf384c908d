"""Learns over the bus in lockstep, as `servo-ctrl learn` does."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from servo_ctrl.config.load import load_machine
from servo_ctrl.daemon.run.report import Progress
from servo_ctrl.daemon.run.run_options import LearningRequest
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.hil_rig.simulated_machine import simulated_machine
from servo_ctrl.hil_rig.simulated_run import RunError
from servo_ctrl.learning.types import Learned


class BusLearning(NamedTuple):
    """Learned functions of all axes; `store` is their directory."""

    store: Path
    axes: dict[str, Learned]
    wall_s: float
    times_real_time: float


async def learn_over_bus(machine: Path, store: Path, on_progress: Callable[[Progress], None]) -> BusLearning:
    """Learn all axes in turn, with the fast learner. Raises ServoCtrlError."""
    config = load_machine(machine)
    request = LearningRequest(learner="fast", fresh=True)
    async with simulated_machine(machine, "lockstep") as bus:
        report = await run_machine(
            config,
            None,
            bus,
            pacing="lockstep",
            record_dir=None,
            on_progress=on_progress,
            learned_dir=store,
            learn=request,
        )
    if report.failed or not report.completed:
        raise RunError(f"learning was not completed: {report.reason}")
    axes = {
        outcome.axis: outcome.learned for outcome in report.outcomes if isinstance(outcome.learned, Learned)
    }
    times_real_time = report.cycles * config.period_s / report.wall_s
    return BusLearning(store, axes, report.wall_s, times_real_time)
