"""The positioning study in the batch twin: hours of machine time in a minute.

The programs are those of `studies.wang_2014.plan`, the same as over the bus. A series runs without a break
from power-up to its end, because friction and lost motion have memory. Every reading is taken by the scale,
and by an ideal interferometer: the true position of the measured point in the plant, set to zero at home.
"""

import os
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hil_sim.config import PlantConfig
from hil_sim.plant.measured_point import measured_point_m
from kernels.arrays import Array
from servo_ctrl.config.kernel_params import axis_params, with_screw
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.program import check_program, program_segments
from servo_ctrl.config.steps import program_steps
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.learned.store import ScrewStore
from servo_ctrl.learning.screw import ScrewLearned, error_table
from servo_ctrl.motion.input_shaper import Taps, shaped, taps
from servo_ctrl.motion.program import Segment
from servo_ctrl.units import MM
from studies.twin_axis import REST_CYCLES, TwinAxis, set_points, twin_axis
from studies.wang_2014.plan import AXIS, SERIES, Series, plan_series, stage_machine
from studies.wang_2014.readings import Deviations, Reading, deviations, write_readings
from studies.wang_2014.stages import STAGES, Stage
from studies.wang_2014.swing import Swing
from studies.wang_2014.twin_screw import learn_screw
from twin.plant_file import load_plant


class TwinRequest(NamedTuple):
    """The stages and series to run in the twin; every series begins at power-up."""

    stages: Sequence[str]
    runs: int
    points: int
    series: Sequence[str]
    learned: Path | None = None
    """Store of the screw table in use; without it the twin learns one."""
    off_cycles: int = 0
    """SYNC periods without power at the beginning."""
    rest_cycles: int = REST_CYCLES
    """SYNC periods at standstill, drives enabled, before the program."""


class TwinRun(NamedTuple):
    """Deviations by (series, stage), and the time of the runs."""

    found: dict[tuple[str, str], Deviations]
    machine_time_s: float
    wall_s: float


class Twin(NamedTuple):
    """The machine that runs the stages; cycles as in `TwinRequest`."""

    directory: Path
    plant: PlantConfig
    off_cycles: int = 0
    rest_cycles: int = REST_CYCLES
    screw: ScrewLearned | None = None
    """The learned screw table, None before learning."""
    swing: Swing | None = None
    """The measured swing of the structure, for stages with an input shaper."""

    @property
    def cycles_before(self) -> int:
        """SYNC periods from power-up to the program."""
        return self.off_cycles + self.rest_cycles


def powered_up(twin: Twin, machine: MachineConfig, params: AxisParams) -> TwinAxis:
    """Return the axis at home with its drive enabled."""
    axis = twin_axis(machine, twin.plant, AXIS, params)
    axis.rollout.rows(np.zeros((twin.cycles_before, 4)), twin.off_cycles)
    return axis


def positioned(
    twin: Twin, stage: Stage, series: Series, runs: int, on_run: Callable[[], None]
) -> list[Reading]:
    """Return all readings of one stage over one series."""
    machine = stage_machine(twin.directory, stage)
    plan = plan_series(machine, stage, series, runs)
    check_program(plan_series(machine, stage, series, 1).program, machine)  # every run repeats the first
    params = axis_params(machine, AXIS)
    if stage.screw and twin.screw is not None:
        params = with_screw(params, error_table(twin.screw), twin.screw.lost_motion_m)
    rollout, p, s = powered_up(twin, machine, params)
    home_m = measured_point_m(p, s)
    readings: list[Reading] = []
    column = list(machine.axes).index(AXIS)
    cycles = twin.cycles_before
    shaper = None
    if stage.shaper is not None and twin.swing is not None:
        shaper = taps(stage.shaper, *twin.swing, machine.period_s)
    segments = program_segments(program_steps(plan.program, machine), machine, [0.0] * len(machine.axes))
    for segment, commands in shaped_segments(segments, column, shaper):
        rows = rollout.rows(commands)
        cycles += len(rows)
        visit = plan.visits.get(segment.step)
        if visit is None:
            continue
        if readings and visit.run > readings[-1].visit.run:
            on_run()
        target_mm = series.targets_mm[visit.target]
        readings.append(
            Reading(
                series=series.name,
                stage=stage.name,
                visit=visit,
                target_mm=target_mm,
                time_s=cycles * machine.period_s,
                scale_m=float(rows["scale_position_m"][-1]) - target_mm * MM,
                interferometer_m=measured_point_m(p, s) - home_m - target_mm * MM,
            )
        )
    on_run()
    return readings


def shaped_segments(
    segments: Iterable[Segment], column: int, shaper: Taps | None
) -> Iterator[tuple[Segment, Array]]:
    """Yield each segment with the set points (n, 4) of an axis, which rests at zero before the first."""
    before = np.zeros((0 if shaper is None else shaper.longest, 4))
    for segment in segments:
        points = set_points(segment, column)
        if shaper is None:
            yield segment, points
            continue
        whole = np.concatenate([before, points])
        yield segment, shaped(whole, shaper)[len(before) :]
        before = whole[len(whole) - shaper.longest :]


def learned_in_twin(twin: Twin, stage: Stage, out: Path) -> ScrewLearned:
    """Learn the screw table of the machine; store it in `out` as the daemon does."""
    machine = stage_machine(twin.directory, stage)
    params = axis_params(machine, AXIS)
    learned = learn_screw(machine, AXIS, powered_up(twin, machine, params).rollout, params)
    ScrewStore(out, machine).add(AXIS, learned, {"source": "batch twin"})
    return learned


def study(
    twin: Twin,
    stages: list[Stage],
    series: list[Series],
    runs: int,
    on_progress: Callable[[float], None] = lambda _share: None,
) -> list[Reading]:
    """Run every stage over every series, a thread per core: the compiled loop holds no interpreter lock.

    `on_progress` receives the completed share, from one thread at a time.
    """
    jobs = [
        (stage, entry)
        for entry in sorted(series, key=lambda entry: -len(entry.targets_mm))
        for stage in stages
    ]
    runs_of = {entry.name: min(runs, entry.most_runs) for entry in series}
    total, done, lock = sum(runs_of[entry.name] for _, entry in jobs), 0, threading.Lock()

    def count_run() -> None:
        nonlocal done
        with lock:
            done += 1
            on_progress(done / total)

    with ThreadPoolExecutor(max_workers=len(os.sched_getaffinity(0))) as pool:
        futures = [
            pool.submit(positioned, twin, stage, entry, runs=runs_of[entry.name], on_run=count_run)
            for stage, entry in jobs
        ]
        return [reading for future in futures for reading in future.result()]


def run_in_twin(
    machine: Path, out: Path, request: TwinRequest, on_progress: Callable[[float], None]
) -> TwinRun:
    """Run the request; write readings.csv and the learned table into `out`. Raises ServoCtrlError."""
    begun_s = time.perf_counter()
    stages = [STAGES[name] for name in request.stages]
    series = [
        SERIES[name]._replace(targets_mm=SERIES[name].targets_mm[: request.points]) for name in request.series
    ]
    twin = Twin(machine, load_plant(machine), request.off_cycles, request.rest_cycles)
    out.mkdir(parents=True, exist_ok=True)
    with_table = next((stage for stage in stages if stage.screw), None)
    if with_table is not None and request.learned is not None:
        stored = ScrewStore(request.learned, stage_machine(machine, with_table)).active(AXIS)
        twin = twin._replace(screw=stored.learned if stored else None)
    elif with_table is not None:
        twin = twin._replace(screw=learned_in_twin(twin, with_table, out / "learned"))
    readings = study(twin, stages, series, request.runs, on_progress)
    write_readings(out / "readings.csv", readings)
    last_s = {(reading.series, reading.stage): reading.time_s for reading in readings}
    return TwinRun(deviations(readings), sum(last_s.values()), time.perf_counter() - begun_s)
