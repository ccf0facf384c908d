"""Learn the waveform compensation (LWC) of one axis in the batch twin, with sines of the learning radius."""

from typing import NamedTuple

import numpy as np

from hil_sim.config import PlantConfig
from kernels.arrays import Array
from servo_ctrl.config.freeze import axis_params
from servo_ctrl.config.learning import learning_settings, stroke_steps
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.learning.performance import evaluation_m, reversals, window_samples
from servo_ctrl.learning.reversal_waveform import (
    AHEAD_S,
    FrictionMemory,
    LoopModel,
    ReversalWaveforms,
    compensation_n,
    corrected,
    cut_out,
    identified,
    missing_force_n,
)
from servo_ctrl.learning.types import NO_PULSE, Stroke
from studies.twin_axis import motion, twin_axis

ACCELERATIONS, ITERATIONS, GAIN = 7, 7, 0.7
"""Reverse accelerations, strokes at each, and learning gain; chosen: 49 strokes and two to identify."""
SPAN_S = 0.45
"""Of a waveform behind the reversal; chosen: beyond twice Tm."""
DEAD_SAMPLES = 3
"""One period until a set point acts, half of holding, half of differencing, rounded up for the current loop;
of 2 and 3 the one with the least J over the learning strokes."""


class LearnedWaveforms(NamedTuple):
    """What one axis learned, in how many strokes, and J (m) at each acceleration from stroke to stroke."""

    learned: ReversalWaveforms
    strokes: int
    course_m: dict[float, list[float]]


class ErrorStrokes:
    """Strokes of one axis with a force offset, each from rest at power-up."""

    def __init__(
        self, machine: MachineConfig, plant: PlantConfig, axis: str, params: AxisParams | None = None
    ) -> None:
        self.machine, self.plant, self.axis = machine, plant, axis
        self.params = axis_params(machine, axis) if params is None else params
        self.settings = learning_settings(machine, axis, "fast")
        self.made = 0
        self._motions: dict[float, Array] = {}

    def reference(self, a_m_s2: float) -> Array:
        """Set points (n, 4) of a stroke, to one span behind its last reversal."""
        if a_m_s2 not in self._motions:
            steps = stroke_steps(self.machine, self.axis, Stroke("waveform", a_m_s2, NO_PULSE), [0.0] * 9)
            whole = motion(self.machine, self.axis, steps)
            end = reversals(whole[:, 0])[-1] + round(1.2 * SPAN_S / self.machine.period_s)
            self._motions[a_m_s2] = whole[:end]
        return self._motions[a_m_s2].copy()

    def error_m(self, reference: Array) -> Array:
        """Make a stroke: error (n,) against the feedback of the position loop."""
        self.made += 1
        rows = twin_axis(self.machine, self.plant, self.axis, self.params).rollout.rows(reference)
        return np.asarray(rows["position_error_m"], dtype=np.float64)


def loop_model(params: AxisParams) -> LoopModel:
    """The controller's own loop, by its gains and the mass of its feedforward."""
    return LoopModel(
        params.feedforward.acceleration_kg,
        params.position_loop.kp_1_s,
        params.velocity_loop.kv_n_s_m,
        params.velocity_loop.ki_n_m,
        params.period_s,
        DEAD_SAMPLES,
    )


def identify(strokes: ErrorStrokes) -> FrictionMemory:
    """Friction with memory from two strokes without compensation."""
    a = strokes.settings.accelerations_m_s2
    seen = []
    for a_m_s2 in (float(np.sqrt(a[0] * a[-1])), a[-1]):
        reference = strokes.reference(a_m_s2)
        seen.append((reference, strokes.error_m(reference)))
    return identified(loop_model(strokes.params), seen)


def friction_alone(friction: FrictionMemory, params: AxisParams) -> ReversalWaveforms:
    """Feedforward of the identified friction, without a waveform; bounded as the largest pulse pushes."""
    limit_n = params.velocity_loop.kv_n_s_m * params.pulse.amplitude_max_m_s
    return ReversalWaveforms(friction, (), (), limit_n, DEAD_SAMPLES)


def learn_waveforms(
    machine: MachineConfig, plant: PlantConfig, axis: str, params: AxisParams | None = None
) -> LearnedWaveforms:
    """Identify friction, then learn a waveform at each acceleration; each begins with its neighbour's."""
    strokes = ErrorStrokes(machine, plant, axis, params)
    loop, settings = loop_model(strokes.params), strokes.settings
    base = friction_alone(identify(strokes), strokes.params)
    length = round((AHEAD_S + SPAN_S) / loop.period_s)
    window = window_samples(settings.window_s, loop.period_s)
    found: dict[float, Array] = {}
    course: dict[float, list[float]] = {}
    wave = np.zeros(length)
    limits = settings.accelerations_m_s2
    for a_m_s2 in np.geomspace(limits[-1], limits[0], ACCELERATIONS).tolist():
        tried: list[tuple[float, Array]] = []
        for _ in range(ITERATIONS):
            learned = base._replace(accelerations_m_s2=(a_m_s2,), waveforms_n=(wave,))
            reference = strokes.reference(a_m_s2)
            reference[:, 3] = compensation_n(learned, reference, loop.period_s)
            error_m = strokes.error_m(reference)
            starts = reversals(reference[:, 0])
            direction = np.sign(reference[starts, 0] - reference[starts - 1, 0])
            tried.append((float(np.mean([evaluation_m(error_m[s : s + window]) for s in starts])), wave))
            missing_n = cut_out(missing_force_n(loop, error_m), starts, direction, length, loop.period_s)
            wave = corrected(wave, missing_n - missing_n[0], GAIN, loop)
        course[a_m_s2] = [j for j, _ in tried]
        wave = min(tried, key=lambda entry: entry[0])[1]  # never worse than before
        found[a_m_s2] = wave
    order = sorted(found)
    learned = base._replace(accelerations_m_s2=tuple(order), waveforms_n=tuple(found[a] for a in order))
    return LearnedWaveforms(learned, strokes.made, course)
