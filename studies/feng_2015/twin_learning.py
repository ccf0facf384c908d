"""Learns in the batch twin: hours of machine time in seconds.

Learner, control law and plant are those of a run over the bus; the results go into a store as the daemon
writes it. The axes learn in parallel, a thread each: the compiled loop of the twin holds no interpreter
lock.
"""

import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

from hil_sim.config import PlantConfig
from kernels.arrays import Array
from servo_ctrl.config.kernel_params import axis_params, with_pulse
from servo_ctrl.config.learning import learning_settings, stroke_steps
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.compensation.trapezoidal_pulse import FrictionCompensationSettings
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.learned.store import LearnedStore
from servo_ctrl.learning.performance import reversals
from servo_ctrl.learning.pulse_functions import constant_table
from servo_ctrl.learning.schedule import LearningRun
from servo_ctrl.learning.stroke_result import evaluation_m, stroke_result, trace_samples
from servo_ctrl.learning.types import Learned, LearningSettings, Stroke, StrokeResult
from studies.twin_axis import motion, twin_axis
from twin.plant_file import load_plant


class TwinStroke(NamedTuple):
    """A stroke in the twin, and its J over Tm, metres."""

    stroke: Stroke
    evaluation_m: float


class LearnedAxis(NamedTuple):
    """The learned functions of one axis, and every stroke with its J."""

    learned: Learned
    strokes: list[TwinStroke]
    wall_s: float

    @property
    def times_real_time(self) -> float:
        """Machine time of the strokes divided by their computing time."""
        return self.learned.machine_time_s / self.wall_s


class TwinLearning(NamedTuple):
    """The learned functions of all axes; `store` is their directory."""

    store: Path
    axes: dict[str, LearnedAxis]
    wall_s: float


class StrokeTwin:
    """Strokes of one axis in the batch twin, each from standstill at power-up."""

    def __init__(
        self, machine: MachineConfig, plant: PlantConfig, axis: str, params: AxisParams | None = None
    ) -> None:
        self._machine, self._plant, self._axis = machine, plant, axis
        self._params = axis_params(machine, axis) if params is None else params
        self._motions: dict[float, Array] = {}

    def stroke(self, stroke: Stroke, settings: LearningSettings) -> StrokeResult:
        """Run one stroke."""
        params = with_pulse(self._params, constant_table(stroke.pulse))
        axis = twin_axis(self._machine, self._plant, self._axis, params)
        rows = axis.rollout.rows(self._motion(stroke, settings))
        scale = self._machine.axes[self._axis].scale is not None
        return stroke_result(
            rows["position_command_m"],
            rows["scale_position_m" if scale else "motor_position_m"],
            stroke,
            settings,
            self._machine.period_s,
        )

    def _motion(self, stroke: Stroke, settings: LearningSettings) -> Array:
        """Return the set points (n, 4) of the stroke up to the last evaluated sample.

        Strokes of one acceleration differ in the pulse alone.
        """
        a = stroke.acceleration_m_s2
        if a not in self._motions:
            steps = stroke_steps(self._machine, self._axis, stroke, [0.0] * len(self._machine.axes))
            whole = motion(self._machine, self._axis, steps)
            samples = trace_samples(stroke, settings, self._machine.period_s)
            self._motions[a] = whole[: reversals(whole[:, 0])[-1] + samples]
        return self._motions[a]


def learn_axis(
    machine: MachineConfig, plant: PlantConfig, axis: str, learner: str, params: AxisParams | None = None
) -> LearnedAxis:
    """Run all strokes of one axis; `params` holds the other compensations, default: as configured."""
    settings = learning_settings(machine, axis, learner)
    twin, run, strokes = StrokeTwin(machine, plant, axis, params), LearningRun(settings), []
    begun_s = time.perf_counter()
    while (stroke := run.stroke) is not None:
        result = twin.stroke(stroke, settings)
        strokes.append(TwinStroke(stroke, evaluation_m(result, settings.window_s)))
        run.take(result)
    if run.learned is None:
        raise RuntimeError("the learner ended without a result")
    return LearnedAxis(run.learned, strokes, time.perf_counter() - begun_s)


def learn_in_twin(machine: Path, store: Path, learner: str) -> TwinLearning:
    """Learn every axis of the machine that has a pulse, and store the results. Raises ServoCtrlError."""
    begun_s = time.perf_counter()
    config, plant = load_machine(machine), load_plant(machine)
    names = [name for name, axis in config.axes.items() if axis.section(FrictionCompensationSettings)]
    with ThreadPoolExecutor(max_workers=len(names) or 1) as pool:
        results = pool.map(lambda name: learn_axis(config, plant, name, learner), names)
        axes = dict(zip(names, results, strict=True))
    learned_store = LearnedStore(store, config)
    for name, entry in axes.items():
        learned_store.add(name, entry.learned, {"made": "batch twin"})
    return TwinLearning(store, axes, time.perf_counter() - begun_s)
