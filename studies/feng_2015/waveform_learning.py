"""Learns the waveform compensation (LWC) of one axis in the batch twin, with sines of the learning radius.

It uses the learning run of the daemon (`servo_ctrl.learning.waveform_run`) and its control law.
"""

from typing import NamedTuple

import numpy as np

from hil_sim.config import PlantConfig
from kernels.arrays import Array
from servo_ctrl.config.kernel_params import axis_params, with_waveform
from servo_ctrl.config.learning import stroke_steps, waveform_settings
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.learning.performance import reversals
from servo_ctrl.learning.rest_force import rest_table
from servo_ctrl.learning.rest_strokes import rest_starts
from servo_ctrl.learning.reversal_waveform import WaveformLearned, identify_friction, wave_table
from servo_ctrl.learning.types import NO_PULSE, Stroke
from servo_ctrl.learning.waveform_run import WaveformRun
from servo_ctrl.learning.waveform_stroke import (
    AFTER_S,
    LEARNER,
    WaveformResult,
    WaveformStroke,
    waveform_result,
)
from studies.twin_axis import motion, twin_axis


class LearnedWaveforms(NamedTuple):
    """The learned waveforms of one axis, and stage, acceleration (m/s^2) and J (m) of every stroke."""

    learned: WaveformLearned
    course: list[tuple[str, float, float]]


class ErrorStrokes:
    """Strokes of one axis, each from standstill at power-up.

    `params` holds the compensations that act beside the waveform; default: as configured.
    """

    def __init__(
        self, machine: MachineConfig, plant: PlantConfig, axis: str, params: AxisParams | None = None
    ) -> None:
        self.machine, self.plant, self.axis = machine, plant, axis
        self.params = axis_params(machine, axis) if params is None else params
        self.settings = waveform_settings(machine, axis)
        self._motions: dict[tuple[float, float], Array] = {}

    def reference(self, a_m_s2: float, rest_s: float = 0.0) -> Array:
        """Return the set points (n, 4) of a stroke up to the last evaluated sample."""
        if (a_m_s2, rest_s) not in self._motions:
            period_s, stroke = self.machine.period_s, Stroke(LEARNER, a_m_s2, NO_PULSE, rest_s)
            start_m = [0.0] * len(self.machine.axes)
            whole = motion(self.machine, self.axis, stroke_steps(self.machine, self.axis, stroke, start_m))
            starts = rest_starts(whole[:, 0], rest_s, period_s) if rest_s else reversals(whole[:, 0])
            self._motions[a_m_s2, rest_s] = whole[: starts[-1] + round(AFTER_S / period_s)]
        return self._motions[a_m_s2, rest_s].copy()

    def error_m(self, reference: Array, params: AxisParams | None = None) -> Array:
        """Run a motion; return the tracking error (n,), metres, of the position loop."""
        axis = twin_axis(self.machine, self.plant, self.axis, self.params if params is None else params)
        return np.asarray(axis.rollout.rows(reference)["position_error_m"], dtype=np.float64)

    def stroke(self, stroke: WaveformStroke) -> WaveformResult:
        """Run a stroke of a learning run."""
        reference = self.reference(stroke.sine.acceleration_m_s2, stroke.sine.rest_s)
        error_m = self.error_m(
            reference, with_waveform(self.params, stroke.friction, stroke.waves, stroke.rests)
        )
        return waveform_result(reference[:, 0], reference[:, 1], error_m, stroke.sine, self.settings)


def with_learned(params: AxisParams, learned: WaveformLearned) -> AxisParams:
    """Return the parameters with the learned friction and waveforms."""
    table = wave_table(learned.accelerations_m_s2, learned.waves_n)
    return with_waveform(params, learned.friction, table, rest_table(learned.rests))


def identify(strokes: ErrorStrokes) -> tuple[float, ...]:
    """Identify the friction with memory from the first strokes of a learning run."""
    run, seen = WaveformRun(strokes.settings), []
    while run.stroke is not None and run.stroke.friction is None:
        result = strokes.stroke(run.stroke)
        seen.append((result.commands, result.error_m))
        run.take(result)
    return identify_friction(strokes.settings.loop, seen)


def learn_waveforms(
    machine: MachineConfig, plant: PlantConfig, axis: str, params: AxisParams | None = None
) -> LearnedWaveforms:
    """Run all strokes of one axis."""
    strokes = ErrorStrokes(machine, plant, axis, params)
    run = WaveformRun(strokes.settings)
    while run.stroke is not None:
        run.take(strokes.stroke(run.stroke))
    if run.learned is None:
        raise RuntimeError("the run has ended without a result")
    return LearnedWaveforms(run.learned, run.course)
