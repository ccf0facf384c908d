"""A short positioning study over the bus in lockstep, compared with the twin reading by reading."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.daemon.run.report import Progress
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.hil_rig.simulated_machine import simulated_machine
from servo_ctrl.hil_rig.simulated_run import RunError, new_recording
from servo_ctrl.recording.reader import Recording, load_recording
from servo_ctrl.units import MM
from studies.wang_2014.plan import AXIS, DIRECTION_NAMES, Series, Visit, plan_series, stage_machine
from studies.wang_2014.stages import Stage


class BusRun(NamedTuple):
    """A run of one stage over one series on the bus."""

    stage: str
    series: Series
    visits: dict[int, Visit]
    """Readings, by the step of the program at whose end each is taken."""
    scale_m: Array
    """Deviations (runs, targets, 2): up, down."""
    cycles_before: tuple[int, int]
    """Cycles before the drive was under control, and from then to the program."""
    recording: Recording
    times_real_time: float


class BusCheck(NamedTuple):
    """A run on the bus, and the readings of the same run in the twin."""

    bus: BusRun
    twin_m: Array
    """Deviations like those of the bus."""

    @property
    def difference_m(self) -> float:
        """Largest difference between the readings of bus and twin."""
        return float(np.abs(self.bus.scale_m - self.twin_m).max())


async def position_over_bus(
    directory: Path,
    stage: Stage,
    series: Series,
    runs: int,
    out: Path,
    learned: Path,
    on_progress: Callable[[Progress], None],
) -> BusRun:
    """Run the same program as the twin; `learned` holds the screw table. Raises ServoCtrlError."""
    machine = stage_machine(directory, stage)
    plan = plan_series(machine, stage, series, runs)
    target = new_recording(out, plan.program.source.name)
    async with simulated_machine(directory, "lockstep") as bus:
        report = await run_machine(
            machine,
            plan.program,
            bus,
            pacing="lockstep",
            record_dir=target,
            on_progress=on_progress,
            learned_dir=learned,
        )
    if report.failed or not report.completed:
        raise RunError(f"{stage.name}: the run was not completed: {report.reason}")
    recording = load_recording(target)
    columns = recording.columns
    segment = columns["segment"]
    scale_m = np.full((runs, len(series.targets_mm), len(DIRECTION_NAMES)), np.nan)
    for step, visit in plan.visits.items():
        read = float(columns[f"{AXIS}.scale_position_m"][np.flatnonzero(segment == step)[-1]])
        target_m = series.targets_mm[visit.target] * MM
        scale_m[visit.run, visit.target, visit.direction] = read - target_m
    engaged = int(np.flatnonzero(np.isfinite(columns[f"{AXIS}.position_command_m"]))[0])
    started = int(np.flatnonzero(segment >= 0)[0])
    speed = report.cycles * machine.period_s / report.wall_s
    cycles_before = engaged, started - engaged
    return BusRun(
        stage=stage.name,
        series=series,
        visits=plan.visits,
        scale_m=scale_m,
        cycles_before=cycles_before,
        recording=recording,
        times_real_time=speed,
    )
