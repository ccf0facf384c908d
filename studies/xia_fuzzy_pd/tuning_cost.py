"""Cost of a position law on one axis of the batch twin: training motions, training plants, measures.

It is the same for every law (docs/fuzzy_pd.md). Training motions and plants differ from those of the study:
the friction is a fifth below and above the known one. Each measure is divided by that of a
proportional reference loop, so that the weights have no units.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from hil_sim.config import PlantConfig
from kernels.arrays import Array, rms
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.motion.move import Dwell, Move
from servo_ctrl.motion.program import Step
from servo_ctrl.motion.sine import Sine
from studies.twin_axis import REST_CYCLES, motion, twin_axis
from studies.xia_fuzzy_pd.tuning_laws import with_law

STEPS_M, HOLD_S = (0.1e-3, 0.25e-3, 0.6e-3, 1.6e-3, 4e-3), 0.4
"""Steps, and the time each is held, seconds; chosen: a nonlinear law needs more than one size."""
SINES = ((3e-3, 0.7), (7e-3, 0.4))
"""Amplitude m and frequency Hz of the sines; chosen."""
CYCLES, TRANSIENT_CYCLES = 1.5, 0.25
"""Cycles of a sine, and those at its start that do not count; chosen."""
FRICTIONS = (0.8, 1.2)
"""Factors of the friction levels and the viscous damping of the plant file; chosen."""
MARGIN = 2.0
"""Factor of the gain with which a step must still settle; chosen."""
MARGIN_STEP = 1
"""Index in STEPS_M of the step with `MARGIN` times the gain; chosen."""
SETTLED_SHARE, REST_S = 0.02, 0.2
"""Bound the error of a settled step, as a share of it, over this time at the end of the hold; chosen."""
REFERENCE_1_S = 20.0
"""Gain of the proportional reference loop, 1/s, whose measures are the unit; chosen."""
OVERSHOOT_WEIGHT, ACTIVITY_WEIGHT, SETTLING_WEIGHT = 100.0, 0.05, 10.0
"""Weights; chosen: 1 % of overshoot, or twenty times the activity, counts as the reference loop's step."""
OSCILLATION_COST_MAX = 3.0
"""Bounds the cost of overshoot and settling beyond which a law is not run further; chosen: above the whole
cost of the reference loop."""
UNSTABLE_COST = 1e6
"""Cost of a law that does not settle: above that of any which does."""


class StepMeasures(NamedTuple):
    """A step up and down."""

    itae_m_s2: float
    overshoot: float
    """Overshoot, or reversed motion after it, less one count; share of the step."""
    settling_error: float
    """Largest error over the end of the hold less SETTLED_SHARE; share of the step."""


class SineMeasures(NamedTuple):
    """The counted part of a sine."""

    rms_m: float
    peak_m: float
    activity_a: float
    """RMS change of the motor current from one period to the next."""


class Measures(NamedTuple):
    """The measures on one plant."""

    steps: list[StepMeasures]
    settling_error: float
    """Largest settling error, including that with `MARGIN` times the gain."""
    sines: list[SineMeasures]


class Training:
    """The training motions of one axis on the training plants."""

    def __init__(self, machine: MachineConfig, plant: PlantConfig, axis: str) -> None:
        self._machine, self._axis = machine, axis
        self._params = axis_params(machine, axis)
        self._period_s = machine.period_s
        scale = machine.axes[axis].scale
        self._count_m = scale.resolution_um * 1e-6 if scale is not None else 0.0
        self._plants = [_with_friction(plant, axis, factor) for factor in FRICTIONS]
        self._steps = [motion(machine, axis, _step_up_and_down(machine, axis, size_m)) for size_m in STEPS_M]
        self._sines = [motion(machine, axis, [_sine(machine, axis, *sine)]) for sine in SINES]
        proportional = {"kp_1_s": REFERENCE_1_S, "ki_1_s2": 0.0, "kd": 0.0, "derivative_filter_ms": 0.0}
        self._reference = self.measured("pid", proportional)

    def cost(self, law: str, values: Mapping[str, float]) -> float:
        """Return the mean cost over the plants; the reference loop's is 2 + `ACTIVITY_WEIGHT` + settling.

        For a law that oscillates or does not come to rest, that alone is the cost: it is not run further.
        """
        params, high_gain = self._laws(law, values)
        costs = []
        for plant, reference in zip(self._plants, self._reference, strict=True):
            steps, settling_error = self._steps_on(plant, params, high_gain)
            oscillation_cost = (
                OVERSHOOT_WEIGHT * max(step.overshoot for step in steps) + SETTLING_WEIGHT * settling_error
            )
            if not oscillation_cost < OSCILLATION_COST_MAX:
                return oscillation_cost if math.isfinite(oscillation_cost) else UNSTABLE_COST
            sines = list(zip(self._sines_on(plant, params), reference.sines, strict=True))
            itae = [a.itae_m_s2 / b.itae_m_s2 for a, b in zip(steps, reference.steps, strict=True)]
            tracking = [0.5 * (a.rms_m / b.rms_m + a.peak_m / b.peak_m) for a, b in sines]
            activity = [a.activity_a / b.activity_a for a, b in sines]
            costs.append(
                np.mean(itae) + np.mean(tracking) + ACTIVITY_WEIGHT * np.mean(activity) + oscillation_cost
            )
        cost = float(np.mean(costs))
        return cost if math.isfinite(cost) else UNSTABLE_COST

    def measured(self, law: str, values: Mapping[str, float]) -> list[Measures]:
        """Return the measures of the law on each plant."""
        params, high_gain = self._laws(law, values)
        return [
            Measures(*self._steps_on(plant, params, high_gain), self._sines_on(plant, params))
            for plant in self._plants
        ]

    def _laws(self, law: str, values: Mapping[str, float]) -> tuple[AxisParams, AxisParams]:
        """Return the parameters with its gain, and with `MARGIN` times that."""
        return with_law(self._params, law, values), with_law(self._params, law, values, MARGIN)

    def _steps_on(
        self, plant: PlantConfig, params: AxisParams, high_gain: AxisParams
    ) -> tuple[list[StepMeasures], float]:
        """Return the measures of all steps, and the largest settling error, also at the higher gain."""
        steps = [
            self._step_measures(plant, params, step, size_m)
            for step, size_m in zip(self._steps, STEPS_M, strict=True)
        ]
        raised = self._step_measures(plant, high_gain, self._steps[MARGIN_STEP], STEPS_M[MARGIN_STEP])
        return steps, max(raised.settling_error, *(step.settling_error for step in steps))

    def _sines_on(self, plant: PlantConfig, params: AxisParams) -> list[SineMeasures]:
        return [
            self._sine_measures(plant, params, sine, frequency_hz)
            for sine, (_, frequency_hz) in zip(self._sines, SINES, strict=True)
        ]

    def _run(self, plant: PlantConfig, params: AxisParams, reference: Array) -> tuple[Array, Array]:
        """Return tracking error by the scale (m) and motor current (A), after the initial standstill."""
        axis = twin_axis(self._machine, plant, self._axis, params)
        rows = axis.rollout.rows(reference)[REST_CYCLES:]
        return rows["position_command_m"] - rows["scale_position_m"], rows["motor_current_a"]

    def _step_measures(
        self, plant: PlantConfig, params: AxisParams, reference: Array, size_m: float
    ) -> StepMeasures:
        error_m, _ = self._run(plant, params, reference)
        half = len(error_m) // 2
        time_s = np.arange(half) * self._period_s
        arrived = half - round(HOLD_S / self._period_s)
        itae, overshoot, settling_error = 0.0, 0.0, 0.0
        for sign, part_m in ((1.0, error_m[:half]), (-1.0, error_m[half : 2 * half])):
            itae += float(np.sum(time_s * np.abs(part_m))) * self._period_s
            missing_m = sign * part_m[arrived:]
            back_m = float(np.max(missing_m - np.minimum.accumulate(missing_m)))
            overshoot = max(overshoot, (max(back_m, -float(np.min(missing_m))) - self._count_m) / size_m)
            last_m = float(np.max(np.abs(part_m[-round(REST_S / self._period_s) :])))
            settling_error = max(settling_error, last_m / size_m - SETTLED_SHARE)
        return StepMeasures(itae, overshoot, settling_error)

    def _sine_measures(
        self, plant: PlantConfig, params: AxisParams, reference: Array, frequency_hz: float
    ) -> SineMeasures:
        error_m, current_a = self._run(plant, params, reference)
        counted = slice(round(TRANSIENT_CYCLES / frequency_hz / self._period_s), None)
        return SineMeasures(
            rms(error_m[counted]), float(np.max(np.abs(error_m[counted]))), rms(np.diff(current_a[counted]))
        )


def _step_up_and_down(machine: MachineConfig, axis: str, size_m: float) -> list[Step]:
    """Return a step as steep as the limits allow, a hold, and the same down."""
    feed_m_s = machine.axes[axis].limits.velocity_mm_s * 1e-3

    def to(position_m: float) -> Move:
        target = tuple(position_m if name == axis else math.nan for name in machine.axes)
        return Move("step", target, feed_m_s, math.inf, trapezoidal=True)

    return [to(size_m), Dwell("held", HOLD_S), to(0.0), Dwell("held", HOLD_S)]


def _sine(machine: MachineConfig, axis: str, amplitude_m: float, frequency_hz: float) -> Sine:
    index = list(machine.axes).index(axis)
    return Sine("sine", index, amplitude_m, 2.0 * math.pi * frequency_hz, CYCLES, ramp_s=0.125 / frequency_hz)


def _with_friction(plant: PlantConfig, axis: str, factor: float) -> PlantConfig:
    """Return the plant with its friction levels and its viscous damping scaled."""
    known = plant.axes[axis]
    effects = dict(known.effects)
    for name, keys in (
        ("coulomb_friction", ("coulomb_n",)),
        ("stribeck_friction", ("stribeck_n",)),
        ("viscous_friction", ("viscous_n_s_m",)),
    ):
        if name in effects:
            changed = {key: getattr(effects[name], key) * factor for key in keys}
            effects[name] = effects[name]._replace(**changed)
    axes = {**plant.axes, axis: known.model_copy(update={"effects": effects})}
    return plant.model_copy(update={"axes": axes})
