"""Every compensation on every machine, in the batch twin: the figures of the decision table.

The controller closes all loops (CST; controller_cst.toml, else controller.toml), so that each compensation
can act. The position loop is closed on the motor encoder or on the scale; each compensation is measured
alone and in useful combinations. The daemon's learners learn on their own strokes; the measured motions are
others.
"""

import math
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hil_sim.config import PlantConfig
from kernels.arrays import Array, rms
from servo_ctrl.config.kernel_params import (
    axis_params,
    with_fuzzy,
    with_observer,
    with_pulse,
    with_sampled_dual_loop,
    with_screw,
)
from servo_ctrl.config.law_sections import SECTION_TYPES
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.program import program_segments
from servo_ctrl.control.compensation.fuzzy_pd import FuzzyPdSettings
from servo_ctrl.control.compensation.sampled_dual_loop import SampledDualLoopSettings
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.learning.pulse_functions import table
from servo_ctrl.learning.screw import error_table
from servo_ctrl.motion.move import Dwell, Move
from servo_ctrl.motion.program import Step
from servo_ctrl.motion.sine import Sine, speed_for_reverse_acceleration
from studies.feng_2015.twin_learning import learn_axis
from studies.twin_axis import REST_CYCLES, set_points, twin_axis
from studies.wang_2014.twin_screw import learn_screw
from twin.axis_rollout import AxisRollout
from twin.plant_file import load_plant

UM = 1e6
AMPLITUDE_M, REVERSE_M_S2 = 0.01, (0.015, 0.07)
"""Amplitude and reverse accelerations of the sines; chosen: between the learned accelerations."""
TARGETS_MM = tuple(range(-36, 37, 9)) + tuple(range(27, -37, -9))
"""End points, approached from below, then from above; chosen: 9 mm are not whole turns of a screw."""
APPROACH_M_S, DWELL_S = 0.05, 1.5
"""Feed to an end point, and dwell before the reading; chosen."""


class Combination(NamedTuple):
    """Compensations that act together; `scale`: it closes the position loop (continuous dual loop)."""

    name: str
    scale: bool
    pulse: bool = False
    observer: bool = False
    fuzzy: bool = False
    screw: bool = False
    sampled: bool = False


COMBINATIONS = (
    Combination("motor encoder", scale=False),
    Combination("motor encoder, pulse", scale=False, pulse=True),
    Combination("motor encoder, observer", scale=False, observer=True),
    Combination("motor encoder, fuzzy-PD", scale=False, fuzzy=True),
    Combination("motor encoder, screw table", scale=False, screw=True),
    Combination("motor encoder, sampled dual loop", scale=False, sampled=True),
    Combination(
        "motor encoder, screw table, sampled dual loop, pulse",
        scale=False,
        pulse=True,
        screw=True,
        sampled=True,
    ),
    Combination("scale", scale=True),
    Combination("scale, pulse", scale=True, pulse=True),
    Combination("scale, observer", scale=True, observer=True),
    Combination("scale, fuzzy-PD", scale=True, fuzzy=True),
    Combination("scale, fuzzy-PD, pulse", scale=True, fuzzy=True, pulse=True),
)


class Row(NamedTuple):
    """Errors of a combination by the scale, micrometres."""

    peak_um: float
    """Largest error of the sines."""
    rms_um: float
    endpoint_um: float
    """Largest error at the end points."""


class AxisStudy:
    """One axis of a machine, measured with each combination."""

    def __init__(self, motor: MachineConfig, scale: MachineConfig, plant: PlantConfig, axis: str) -> None:
        self._motor, self._scale = with_feedback(motor, axis, "motor"), with_feedback(scale, axis, "scale")
        self._plant, self._axis = plant, axis

    def figures(self, acting: Combination) -> Row:
        """Learn the compensations of the combination where needed, and measure it."""
        machine = self._scale if acting.scale else self._motor
        params = self._params(machine, acting)
        rollout, column = self._rollout(machine, params), list(machine.axes).index(self._axis)
        rollout.rows(np.zeros((REST_CYCLES, 4)))
        sines, ends = [], []
        for segment in program_segments(_steps(column), machine, [0.0] * len(machine.axes)):
            rows = rollout.rows(set_points(segment, column))
            error_m = rows["position_command_m"] - rows["scale_position_m"]
            if segment.label == "sine":
                sines.append(_whole_cycles(error_m))
            elif segment.label == "at":
                ends.append(error_m[-1])  # the error with which the next program line would start
        return Row(
            UM * max(float(np.abs(e).max()) for e in sines),
            UM * max(rms(e) for e in sines),
            UM * float(np.abs(ends).max()),
        )

    def _params(self, machine: MachineConfig, acting: Combination) -> AxisParams:
        """Return the parameters of the combination, each compensation learned with the others in action."""
        params = axis_params(machine, self._axis)
        params = with_fuzzy(params, enabled=acting.fuzzy)
        params = with_sampled_dual_loop(params, enabled=False)
        if acting.pulse:
            functions = learn_axis(machine, self._plant, self._axis, "fast", params).learned
            params = with_pulse(params, table(functions))
        if acting.screw:
            screw = learn_screw(machine, self._axis, self._rollout(machine, params), params)
            params = with_screw(params, error_table(screw), screw.lost_motion_m)
        return with_sampled_dual_loop(with_observer(params, enabled=acting.observer), enabled=acting.sampled)

    def _rollout(self, machine: MachineConfig, params: AxisParams) -> AxisRollout:
        return twin_axis(machine, self._plant, self._axis, params).rollout


def with_feedback(machine: MachineConfig, axis: str, feedback: str) -> MachineConfig:
    """Return the machine with the position loop on `feedback`: "scale", or "motor" with its compensations."""
    config = machine.axes[axis]
    changes: dict[str, object] = {"control": config.control.model_copy(update={"feedback": feedback})}
    if feedback == "motor" and config.scale is not None:
        count_um = config.scale.resolution_um
        changes["screw_compensation"] = SECTION_TYPES["screw_compensation"]()
        changes["sampled_dual_loop"] = SampledDualLoopSettings(tolerance_um=count_um, settle_ms=200.0)
    return machine.model_copy(update={"axes": {**machine.axes, axis: config.model_copy(update=changes)}})


def on_the_scale(machine: MachineConfig, directory: Path) -> MachineConfig:
    """Return the machine with the gain of its continuous dual loop, where this has a file of its own."""
    file = directory / "controller_continuous.toml"
    if not file.exists():
        return machine
    gain_1_s = {name: axis.control.kp_1_s for name, axis in load_machine(file).axes.items()}
    axes = {
        name: axis.model_copy(update={"control": axis.control.model_copy(update={"kp_1_s": gain_1_s[name]})})
        for name, axis in machine.axes.items()
    }
    return machine.model_copy(update={"axes": axes})


def _steps(column: int) -> list[Step]:
    steps: list[Step] = []
    for acceleration_m_s2 in REVERSE_M_S2:
        speed_rad_s = speed_for_reverse_acceleration(AMPLITUDE_M, acceleration_m_s2)
        ramp_s = 0.1 * 2.0 * math.pi / speed_rad_s
        steps += [
            Sine(
                label="sine",
                axis=column,
                amplitude_m=AMPLITUDE_M,
                speed_rad_s=speed_rad_s,
                cycles=4.0,
                ramp_s=ramp_s,
            ),
            Dwell("rest", 0.5),
        ]
    for target_mm in TARGETS_MM:
        to_m = tuple(target_mm * 1e-3 if i == column else math.nan for i in range(column + 1))
        steps += [Move("to", to_m, APPROACH_M_S, math.inf, trapezoidal=False), Dwell("at", DWELL_S)]
    return steps


def _whole_cycles(error_m: Array) -> Array:
    """Return the two middle cycles of four, which have no ramps."""
    quarter = len(error_m) // 4
    return error_m[quarter : 3 * quarter]


def measured(directory: Path, on_progress: Callable[[str], None]) -> dict[str, Row]:
    """Measure every combination on the first axis of one machine. Raises ServoCtrlError."""
    file = directory / "controller_cst.toml"
    machine, plant = load_machine(file if file.exists() else directory), load_plant(directory)
    axis = next(iter(machine.axes))
    study = AxisStudy(machine, on_the_scale(machine, directory), plant, axis)
    configured = machine.axes[axis].section(FuzzyPdSettings) is not None
    combinations = [entry for entry in COMBINATIONS if configured or not entry.fuzzy]
    found = {}
    for done, entry in enumerate(combinations):
        on_progress(f"{done}/{len(combinations)} {entry.name}")
        found[entry.name] = study.figures(entry)
    return found
