"""The positioning study in the batch twin: hours of machine time in a minute.

    python -m reconcile.positioning --machine machines/precision_stage --out readings.csv [--stages a,b]

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
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hil_sim.config import build_plant, load_plant
from hil_sim.plant.measured_point import measured_point_m
from reconcile.axis_rollout import COLUMNS, AxisRollout
from reconcile.rollout import substeps_of
from reconcile.wiring import wires_of
from servo_ctrl.config.freeze import MM, axis_params
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

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from hil_sim.config import PlantConfig
    from servo_ctrl.control.params import AxisParams
    from servo_ctrl.motion.program import Segment

    Array = NDArray[np.float64]

SCALE = COLUMNS.index("scale_position_m")
REST_CYCLES = 50
"""Standing still before the program, drives on."""


class Power(NamedTuple):
    """Cycles before the program."""

    off: int = 0
    """Without power."""
    rest: int = REST_CYCLES
    """Standing still, drives on."""


def positioned(
    directory: Path,
    plant_config: PlantConfig,
    stage: Stage,
    series: Series,
    runs: int,
    params_of: Callable[[AxisParams], AxisParams],
    power: Power,
    on_run: Callable[[], None],
) -> list[Reading]:
    """All readings of one stage over one series, in one go; `params_of` puts in what was learned."""
    machine = stage_machine(directory, stage)
    plan = plan_series(machine, stage, series, runs)
    check_program(plan_series(machine, stage, series, 1).program, machine)  # the others are the same motion
    plant = build_plant(plant_config)
    index = list(plant_config.axes).index(AXIS)
    wires = wires_of(machine.axes[AXIS], plant_config.axes[AXIS])
    plant.setpoint[index]["current_limit_a"] = wires.current_limit_a
    params = params_of(axis_params(machine, AXIS))
    substeps = substeps_of(machine, plant_config)
    axis = AxisRollout(params, wires, plant, index, substeps, plant_config.dt_s)
    axis.rows(np.zeros((power.off + power.rest, 4)), power.off)
    home_m = measured_point_m(plant.params[index], plant.state[index])
    readings: list[Reading] = []
    column = list(machine.axes).index(AXIS)
    cycles = power.off + power.rest
    for segment in program_segments(program_steps(plan.program, machine), machine, [0.0] * len(machine.axes)):
        rows = axis.rows(_commands(segment, column))
        cycles += len(rows)
        visit = plan.visits.get(segment.step)
        if visit is None:
            continue
        if readings and visit.run > readings[-1].visit.run:
            on_run()
        target_mm = series.targets_mm[visit.target]
        truth_m = measured_point_m(plant.params[index], plant.state[index]) - home_m
        readings.append(
            Reading(
                series.name,
                stage.name,
                visit,
                target_mm,
                cycles * machine.period_s,
                float(rows[-1, SCALE]) - target_mm * MM,
                truth_m - target_mm * MM,
            )
        )
    on_run()
    return readings


def _commands(segment: Segment, column: int) -> Array:
    parts = (segment.position_m, segment.velocity_m_s, segment.acceleration_m_s2, segment.force_offset_n)
    return np.stack([part[:, column] for part in parts], axis=-1)


class _Shown:
    """Progress for who started us: a line whenever a run is over."""

    def __init__(self, total: int) -> None:
        self._total, self._done, self._lock = total, 0, threading.Lock()

    def __call__(self) -> None:
        with self._lock:
            self._done += 1
            print(f"progress {self._done} {self._total}", flush=True)  # noqa: T201 a script


def study(
    directory: Path,
    plant_config: PlantConfig,
    stages: list[Stage],
    series: list[Series],
    runs: int,
    power: Power,
) -> list[Reading]:
    """Every stage over every series, as many at once as there are cores: the loop needs no interpreter."""
    jobs = [
        (stage, entry)
        for entry in sorted(series, key=lambda entry: -len(entry.targets_mm))
        for stage in stages
    ]
    shown = _Shown(len(jobs) * runs)
    with ThreadPoolExecutor(max_workers=len(os.sched_getaffinity(0))) as pool:
        futures = [
            pool.submit(
                positioned, directory, plant_config, stage, entry, runs, lambda params: params, power, shown
            )
            for stage, entry in jobs
        ]
        return [reading for future in futures for reading in future.result()]


def main() -> None:
    """Run the study, write the readings."""
    parser = argparse.ArgumentParser(description="The positioning study in the batch twin.")
    parser.add_argument("--machine", type=Path, required=True, help="directory of the machine")
    parser.add_argument("--plant", type=Path, help="another plant file; default: the machine's plant.toml")
    parser.add_argument("--out", type=Path, required=True, help="file for the readings (CSV)")
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
    readings = study(
        options.machine,
        load_plant(options.plant or options.machine),
        stages,
        series,
        options.runs,
        Power(options.off_cycles, options.rest_cycles),
    )
    options.out.parent.mkdir(parents=True, exist_ok=True)
    write_readings(options.out, readings)
    last_s = {(reading.series, reading.stage): reading.time_s for reading in readings}
    print(f"machine_time {sum(last_s.values()):.1f}")  # noqa: T201 a script
    print(f"wall {time.perf_counter() - begun_s:.1f}")  # noqa: T201 a script


if __name__ == "__main__":
    main()
