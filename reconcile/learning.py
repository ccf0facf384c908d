"""Whole learning in the batch twin: hours of machine time in seconds.

    python -m reconcile.learning --machine machines/xy_table --out out/learned [--learner paper] [--json FILE]

The same learner, control law and plant as over the bus; a process an axis. Results go into a store like the
daemon's; `--json` keeps every stroke and its J, so that some can be repeated on the bus.
"""

from __future__ import annotations

import argparse
import json
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hil_sim.config import build_plant, load_plant
from reconcile.rollout import rollout_axis, substeps_of
from reconcile.wiring import wires_of
from servo_ctrl.config.freeze import axis_params, with_pulse
from servo_ctrl.config.learning import learning_settings, stroke_steps
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.program import program_segments
from servo_ctrl.experiment.simulated_machine import ends_with_its_parent
from servo_ctrl.learning.performance import reversals
from servo_ctrl.learning.pulse_functions import constant_table
from servo_ctrl.learning.schedule import LearningRun
from servo_ctrl.learning.stroke_result import evaluation_m, stroke_result, trace_samples
from servo_ctrl.telemetry.learned_store import LearnedStore
from servo_ctrl.telemetry.parquet import write_whole

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil_sim.config import PlantConfig
    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.control.params import AxisParams
    from servo_ctrl.learning.types import Learned, LearningSettings, Stroke, StrokeResult

    Array = NDArray[np.float64]

REST_CYCLES = 50
"""Standing still before the stroke, drives on."""


class TwinLearning(NamedTuple):
    """What one axis learned, and every stroke with its J."""

    axis: str
    learned: Learned
    strokes: list[dict[str, Any]]
    wall_s: float


class TwinAxis:
    """An axis of the batch twin that makes strokes, each from rest at power-up."""

    def __init__(
        self, machine: MachineConfig, plant: PlantConfig, axis: str, params: AxisParams | None = None
    ) -> None:
        self._machine, self._plant, self._axis = machine, plant, axis
        self._params = axis_params(machine, axis) if params is None else params
        self._wires = wires_of(machine.axes[axis], plant.axes[axis])
        self._index = list(plant.axes).index(axis)
        self._substeps = substeps_of(machine, plant)
        self._motions: dict[float, Array] = {}

    def stroke(self, stroke: Stroke, settings: LearningSettings) -> StrokeResult:
        """Make one stroke."""
        plant = build_plant(self._plant)
        plant.setpoint[self._index]["current_limit_a"] = self._wires.current_limit_a
        rows = rollout_axis(
            with_pulse(self._params, constant_table(stroke.pulse)),
            self._wires,
            plant,
            self._index,
            self._substeps,
            self._plant.dt_s,
            self._motion(stroke, settings),
            0,
        )
        scale = self._machine.axes[self._axis].scale is not None
        return stroke_result(rows[:, 0], rows[:, 3 if scale else 2], stroke, settings, self._machine.period_s)

    def _motion(self, stroke: Stroke, settings: LearningSettings) -> Array:
        """Set points (n, 4) of the stroke up to where its last error is taken: what follows tells nothing.

        Strokes of one acceleration differ in the pulse alone.
        """
        a = stroke.acceleration_m_s2
        if a not in self._motions:
            index = list(self._machine.axes).index(self._axis)
            start_m = [0.0] * len(self._machine.axes)
            steps = stroke_steps(self._machine, self._axis, stroke, start_m)
            parts = [np.zeros((REST_CYCLES, 4))]
            for part in program_segments(steps, self._machine, start_m):
                columns = (part.position_m, part.velocity_m_s, part.acceleration_m_s2, part.force_offset_n)
                parts.append(np.stack([column[:, index] for column in columns], axis=-1))
            motion = np.concatenate(parts)
            samples = trace_samples(stroke, settings, self._machine.period_s)
            self._motions[a] = motion[: reversals(motion[:, 0])[-1] + samples]
        return self._motions[a]


def learn_axis(
    machine: MachineConfig, plant: PlantConfig, axis: str, learner: str, params: AxisParams | None = None
) -> TwinLearning:
    """All strokes of one axis; `params`: with what else acts, default as configured."""
    settings = learning_settings(machine, axis, learner)
    twin, run, strokes = TwinAxis(machine, plant, axis, params), LearningRun(settings), []
    begun_s = time.perf_counter()
    while (stroke := run.stroke) is not None:
        result = twin.stroke(stroke, settings)
        score_m = evaluation_m(result, settings.window_s)
        strokes.append({**stroke._asdict(), "pulse": list(stroke.pulse), "evaluation_m": score_m})
        run.take(result)
    if run.learned is None:
        raise RuntimeError("the learner ended without a result")
    return TwinLearning(axis, run.learned, strokes, time.perf_counter() - begun_s)


def _learn_from_files(machine: Path, plant: Path, axis: str, learner: str) -> TwinLearning:
    return learn_axis(load_machine(machine), load_plant(plant), axis, learner)


def _end_with_us() -> None:
    """A worker that lost its parent would wait for work for ever."""
    if (request := ends_with_its_parent()) is not None:
        request()


def learn_all(machine: Path, plant: Path, learner: str) -> list[TwinLearning]:
    """Every axis that has a pulse to learn, each in its own process."""
    axes = [name for name, axis in load_machine(machine).axes.items() if axis.friction_compensation]
    with ProcessPoolExecutor(max_workers=len(axes) or 1, initializer=_end_with_us) as pool:
        futures = [pool.submit(_learn_from_files, machine, plant, axis, learner) for axis in axes]
        return [future.result() for future in futures]


def main() -> None:
    """Learn and store."""
    parser = argparse.ArgumentParser(description="Friction compensation learned in the batch twin.")
    parser.add_argument("--machine", type=Path, required=True, help="directory of the machine")
    parser.add_argument("--plant", type=Path, help="another plant file; default: the machine's plant.toml")
    parser.add_argument("--out", type=Path, required=True, help="directory for the learned results")
    parser.add_argument("--learner", choices=("paper", "fast"), default="paper")
    parser.add_argument("--json", type=Path, help="write the strokes and figures to this file")
    options = parser.parse_args()
    begun_s = time.perf_counter()
    found = learn_all(options.machine, options.plant or options.machine, options.learner)
    wall_s = time.perf_counter() - begun_s
    store = LearnedStore(options.out, load_machine(options.machine))
    for entry in found:
        store.add(entry.axis, entry.learned, {"made": "batch twin"})
        learned = entry.learned
        print(  # noqa: T201 a script
            f"axis {entry.axis}: {learned.strokes} strokes, {learned.machine_time_s / 3600:.2f} h "
            f"of machine time in {entry.wall_s:.1f} s, "
            f"J {learned.before_m * 1e6:.2f} -> {learned.after_m * 1e6:.2f} um"
        )
    machine_s = sum(entry.learned.machine_time_s for entry in found)
    print(f"{machine_s / wall_s:.0f} times real time, {wall_s:.1f} s with start-up")  # noqa: T201 a script
    if options.json:
        figures = {
            "wall_s": wall_s,
            "axes": {
                entry.axis: {
                    "learned": entry.learned._asdict(),
                    "wall_s": entry.wall_s,
                    "strokes": entry.strokes,
                }
                for entry in found
            },
        }
        text = json.dumps(figures) + "\n"
        write_whole(options.json, lambda temporary: temporary.write_text(text, encoding="utf-8"))


if __name__ == "__main__":
    main()
