"""The positioning study in the batch twin: hours of machine time in a minute.

    python -m reconcile.positioning --machine machines/precision_stage --out out/positioning [--stages a,b]

The programs are those of `servo_ctrl.experiment.positioning_plan`, the same as over the bus. A series is
rolled out from power-up to its end, so that each reading begins where the one before left the stage. Every
reading is taken by the scale, and by an ideal interferometer: the plant's truth at the measured point, set
to zero at home.
"""

from __future__ import annotations

import argparse
import os
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hil_sim.config import build_plant, load_plant
from hil_sim.plant.measured_point import measured_point_m
from reconcile.axis_rollout import COLUMNS, AxisRollout
from reconcile.positioning_screw import commands_of, learn_screw
from reconcile.rollout import substeps_of
from reconcile.wiring import wires_of
from servo_ctrl.config.freeze import MM, axis_params, with_screw
from servo_ctrl.config.program import check_program, program_segments
from servo_ctrl.config.steps import program_steps
from servo_ctrl.experiment.positioning_plan import (
    AXIS,
    SERIES,
    STAGES,
    Series,
    Stage,
    plan_series,
    stage_machine,
)
from servo_ctrl.experiment.positioning_readings import Reading, write_readings
from servo_ctrl.learning.screw import error_table
from servo_ctrl.telemetry.learned_store import ScrewStore

if TYPE_CHECKING:
    from collections.abc import Callable

    from hil_sim.config import PlantConfig
    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.control.params import AxisParams
    from servo_ctrl.learning.screw import ScrewLearned

SCALE = COLUMNS.index("scale_position_m")
REST_CYCLES = 50
"""Standing still before the program, drives on."""


class Power(NamedTuple):
    """Cycles before the program."""

    off: int = 0
    """Without power."""
    rest: int = REST_CYCLES
    """Standing still, drives on."""


class Twin(NamedTuple):
    """What the stages are run on. `screw` is what the machine has learned, None before."""

    directory: Path
    plant: PlantConfig
    power: Power
    screw: ScrewLearned | None = None


def powered_up(twin: Twin, machine: MachineConfig, params: AxisParams) -> tuple[AxisRollout, Any, Any]:
    """The axis at home, drives on; the plant's parameters and state of it."""
    plant = build_plant(twin.plant)
    index = list(twin.plant.axes).index(AXIS)
    wires = wires_of(machine.axes[AXIS], twin.plant.axes[AXIS])
    plant.setpoint[index]["current_limit_a"] = wires.current_limit_a
    axis = AxisRollout(params, wires, plant, index, substeps_of(machine, twin.plant), twin.plant.dt_s)
    axis.rows(np.zeros((twin.power.off + twin.power.rest, 4)), twin.power.off)
    return axis, plant.params[index], plant.state[index]


def positioned(
    twin: Twin, stage: Stage, series: Series, runs: int, on_run: Callable[[], None]
) -> list[Reading]:
    """All readings of one stage over one series, in one go."""
    machine = stage_machine(twin.directory, stage)
    plan = plan_series(machine, stage, series, runs)
    check_program(plan_series(machine, stage, series, 1).program, machine)  # the others are the same motion
    params = axis_params(machine, AXIS)
    if stage.screw and twin.screw is not None:
        params = with_screw(params, error_table(twin.screw), twin.screw.lost_motion_m)
    axis, p, s = powered_up(twin, machine, params)
    home_m = measured_point_m(p, s)
    readings: list[Reading] = []
    column = list(machine.axes).index(AXIS)
    cycles = twin.power.off + twin.power.rest
    for segment in program_segments(program_steps(plan.program, machine), machine, [0.0] * len(machine.axes)):
        rows = axis.rows(commands_of(segment, column))
        cycles += len(rows)
        visit = plan.visits.get(segment.step)
        if visit is None:
            continue
        if readings and visit.run > readings[-1].visit.run:
            on_run()
        target_mm = series.targets_mm[visit.target]
        readings.append(
            Reading(
                series.name,
                stage.name,
                visit,
                target_mm,
                cycles * machine.period_s,
                float(rows[-1, SCALE]) - target_mm * MM,
                measured_point_m(p, s) - home_m - target_mm * MM,
            )
        )
    on_run()
    return readings


def learned_in_twin(twin: Twin, stage: Stage, out: Path) -> ScrewLearned:
    """What the machine learns of its screw; stored in `out` as the daemon stores it."""
    machine = stage_machine(twin.directory, stage)
    params = axis_params(machine, AXIS)
    axis, _, _ = powered_up(twin, machine, params)
    learned = learn_screw(machine, AXIS, axis, params)
    ScrewStore(out, machine).add(AXIS, learned, {"source": "batch twin"})
    print(f"lost_motion_um {learned.lost_motion_m * 1e6:.3f}")  # noqa: T201 a script
    print(f"J_before_um {learned.before_m * 1e6:.3f}")  # noqa: T201 a script
    print(f"J_after_um {learned.after_m * 1e6:.3f}")  # noqa: T201 a script
    return learned


def stored_screw(directory: Path, stage: Stage, store: Path) -> ScrewLearned | None:
    """What is in use there. Raises ServoCtrlError."""
    stored = ScrewStore(store, stage_machine(directory, stage)).active(AXIS)
    return None if stored is None else stored.learned


class _Shown:
    """Progress for who started us: a line whenever a run is over."""

    def __init__(self, total: int) -> None:
        self._total, self._done, self._lock = total, 0, threading.Lock()

    def __call__(self) -> None:
        with self._lock:
            self._done += 1
            print(f"progress {self._done} {self._total}", flush=True)  # noqa: T201 a script


def study(twin: Twin, stages: list[Stage], series: list[Series], runs: int) -> list[Reading]:
    """Every stage over every series, as many at once as there are cores: the loop needs no interpreter."""
    jobs = [
        (stage, entry)
        for entry in sorted(series, key=lambda entry: -len(entry.targets_mm))
        for stage in stages
    ]
    runs_of = {entry.name: min(runs, entry.most_runs) for entry in series}
    shown = _Shown(sum(runs_of[entry.name] for _, entry in jobs))
    with ThreadPoolExecutor(max_workers=len(os.sched_getaffinity(0))) as pool:
        futures = [
            pool.submit(positioned, twin, stage, entry, runs_of[entry.name], shown) for stage, entry in jobs
        ]
        return [reading for future in futures for reading in future.result()]


def main() -> None:
    """Run the study, write the readings."""
    parser = argparse.ArgumentParser(description="The positioning study in the batch twin.")
    parser.add_argument("--machine", type=Path, required=True, help="directory of the machine")
    parser.add_argument("--plant", type=Path, help="another plant file; default: the machine's plant.toml")
    parser.add_argument("--out", type=Path, required=True, help="folder for readings.csv and what is learned")
    parser.add_argument("--learned", type=Path, help="use the screw stored here instead of learning it")
    parser.add_argument("--stages", default=",".join(STAGES), help="names, separated by commas")
    parser.add_argument("--series", default=",".join(SERIES), help="names, separated by commas")
    parser.add_argument("--runs", type=int, default=100, help="cycles of every series")
    parser.add_argument("--points", type=int, default=20, help="targets of a series, the first ones")
    parser.add_argument("--off-cycles", type=int, default=0, help="cycles without power at the beginning")
    parser.add_argument(
        "--rest-cycles", type=int, default=REST_CYCLES, help="cycles at rest before the program"
    )
    options = parser.parse_args()
    stages = [STAGES[name] for name in options.stages.split(",")]
    series = [
        SERIES[name]._replace(targets_mm=SERIES[name].targets_mm[: options.points])
        for name in options.series.split(",")
    ]
    begun_s = time.perf_counter()
    options.out.mkdir(parents=True, exist_ok=True)
    power = Power(options.off_cycles, options.rest_cycles)
    twin = Twin(options.machine, load_plant(options.plant or options.machine), power)
    with_table = next((stage for stage in stages if stage.screw), None)
    if with_table is not None and options.learned is not None:
        twin = twin._replace(screw=stored_screw(options.machine, with_table, options.learned))
    elif with_table is not None:
        twin = twin._replace(screw=learned_in_twin(twin, with_table, options.out / "learned"))
    readings = study(twin, stages, series, options.runs)
    write_readings(options.out / "readings.csv", readings)
    last_s = {(reading.series, reading.stage): reading.time_s for reading in readings}
    print(f"machine_time {sum(last_s.values()):.1f}")  # noqa: T201 a script
    print(f"wall {time.perf_counter() - begun_s:.1f}")  # noqa: T201 a script


if __name__ == "__main__":
    main()
