"""Search for the gains and the notch with which a disturbing force moves an axis least.

The cost of a candidate is what a step of force does to the axis: the largest deviation, from P / (1 + L) by
the inverse Fourier integral, and its integral over time, 1 / (kp ki) (Astrom and Hagglund, Advanced PID
Control, section 4.3). Constraints:

- Ms of the loop at the amplifier's set point, all paths together, is at most the stated one;
- with every mode of the model 7 % lower or higher, the loop is stable and Ms at most a quarter above it;
- with 30 % more or less mass it is stable and Ms at most half above it (backlash that opens takes mass off
  the motor);
- the velocity loop alone is stable with Ms at most 2.5: the position loop may be open at a limit;
- where contour control couples the axis to another one, Ms of both (`contour_partner`) is at most the stated
  one, or that of the other axis alone where it is above;
- the quantisation of the encoders makes at most 1 % of the force limit (RMS).
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import Bounds, differential_evolution

from kernels.arrays import Array
from servo_ctrl.control.axis_loop import (
    Response,
    integrators_of,
    loop_of,
    notch_response,
    on_circle,
    position_law,
    velocity_estimate,
    velocity_law,
    velocity_loop_of,
)
from servo_ctrl.control.compensation import notch
from servo_ctrl.control.modal_model import ModalModel, StructuralMode
from servo_ctrl.control.stability import is_stable
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.tuning.contour_partner import ContourPartner
from servo_ctrl.tuning.frequency_response import FrequencyResponse
from servo_ctrl.tuning.loop import plant_of

SHIFTS, SHIFTED_MS = (0.93, 1.07), 1.25
"""Factors on all mode frequencies, and on Ms there. Chosen, as are the numbers below."""
LOOP_GAINS, LOADED_MS = (1.0 / 0.7, 1.0 / 1.3), 1.5
"""Factors on the loop gain by less and by more mass, and on Ms there."""
VELOCITY_MS = 2.5
NOISE_SHARE = 0.01
STEP_S, STEP_POINTS = 0.3, 60
"""Time after a step of force for which the deviation is computed, and at how many instants."""
INFEASIBLE = 1e3
"""Cost of a candidate whose Ms is too high; half of it where another constraint is violated."""
UNSTABLE = 10.0
"""Part of a cost by a loop that is not stable."""
SEED, POPULATION, GENERATIONS = 24, 10, 60


class EncoderSteps(NamedTuple):
    """Quantisation of the motor's encoder and of the feedback, metres per count; 0: ignore it."""

    motor_m: float
    feedback_m: float


class GainSearch:
    """The plants on which a candidate is judged, and the search over candidates.

    A candidate x holds the natural logarithms of kv / m, ki / kv (1/s each) and kp (1/s), and with a notch
    those of its frequency (Hz), damping ratio and depth.
    """

    def __init__(
        self,
        params: AxisParams,
        model: ModalModel,
        measured: FrequencyResponse,
        ms: float,
        steps: EncoderSteps,
        largest_kp_1_s: float,
        partner: ContourPartner | None,
    ) -> None:
        self.params, self.model, self.ms, self.steps = params, model, ms, steps
        self.largest_kp_1_s = largest_kp_1_s
        scale = params.position_loop.scale_feedback
        beside = () if partner is None else partner.measured
        self.plant = plant_of(model, measured, scale_feedback=scale, beside=beside)
        # as measured, and as the machine file will know it: what is written there is not to be refused
        plants = (self.plant, plant_of(model, None, scale_feedback=scale, beside=beside))
        self._pairs = () if partner is None else tuple(partner.on(plant) for plant in plants)
        self._pair_ms = max((ms, *(pair.of_partner() for pair in self._pairs)))
        w = 2.0 * math.pi * self.plant.frequency_hz
        times_s = np.geomspace(2.0 * params.period_s, STEP_S, STEP_POINTS)
        self._step_kernel = 2.0 / math.pi * np.sin(np.outer(times_s, w)) / w * np.gradient(w)
        shifts = SHIFTS if model.modes else ()
        self._shifted = [plant_of(model, None, scale_feedback=scale, shift=shift) for shift in shifts]

    def with_values(self, x: Array) -> AxisParams:
        """Return the parameters of the axis with the values of a candidate."""
        p, values = self.params, np.exp(x)
        kv = float(values[0]) * self.model.mass_kg
        filters = notch.NEUTRAL
        if len(x) > 3:
            filters = notch.biquad(float(values[3]), float(values[4]), float(values[5]), p.period_s)
        return p._replace(
            position_loop=p.position_loop._replace(kp_1_s=float(values[2])),
            velocity_loop=p.velocity_loop._replace(kv_n_s_m=kv, ki_n_m=float(values[1]) * kv),
            notch=filters,
        )

    def cost(self, x: Array) -> float:
        """Logarithm of the effect of a force; where a constraint is violated, a large cost by how far."""
        params = self.with_values(x)
        loop, integrators = loop_of(params, self.plant), integrators_of(params)
        excess = _ms_excess(loop, integrators, self.ms)
        if excess > 0.0:
            return INFEASIBLE + excess
        if self._pairs:
            peak = max(pair.sensitivity_peak(params) for pair in self._pairs)
            excess = min(UNSTABLE, max(0.0, math.log(peak / self._pair_ms)))
            if excess > 0.0:
                return INFEASIBLE + excess
        excess = _ms_excess(velocity_loop_of(params, self.plant), 2, VELOCITY_MS)
        for gain in LOOP_GAINS:
            excess += _ms_excess(gain * loop, integrators, LOADED_MS * self.ms)
        for plant in self._shifted:
            excess += _ms_excess(loop_of(params, plant), integrators, SHIFTED_MS * self.ms)
        excess += max(0.0, math.log(self._noise_n(params, loop) / (NOISE_SHARE * params.limits.force_n)))
        if excess > 0.0:
            return 0.5 * INFEASIBLE + excess
        integral = params.position_loop.kp_1_s * params.velocity_loop.ki_n_m
        return math.log(self._step_peak(loop)) - 0.25 * math.log(integral)

    def _step_peak(self, loop: Response) -> float:
        """Largest deviation after a step of 1 N, m: 2 / pi times the integral of Re G sin(w t) / w."""
        return float(np.max(np.abs(self._step_kernel @ (self.plant.feedback / (1.0 + loop)).real)))

    def _noise_n(self, params: AxisParams, loop: Response) -> float:
        """RMS of the force by the quantisation of the encoders, each uniformly distributed over one step."""
        z = on_circle(self.plant.frequency_hz, params.period_s)
        outer = notch_response(params.notch, z) * velocity_law(params, z) / (1.0 + loop)
        paths = (
            (velocity_estimate(params, z), self.steps.motor_m),
            (position_law(params, z), self.steps.feedback_m),
        )
        width = np.gradient(self.plant.frequency_hz) * 2.0 * params.period_s
        squares = sum(
            float(np.sum(np.abs(outer * path) ** 2 * width)) * step**2 / 12.0 for path, step in paths
        )
        return math.sqrt(max(squares, 1e-30))

    def best(self, mode: StructuralMode | None) -> tuple[float, Array]:
        """Cost and values of the best candidate, with a notch near a mode, or without one.

        Differential evolution with a fixed seed: the same measurement gives the same proposal.
        """
        period_s = self.params.period_s
        bounds: list[tuple[float, float]] = [
            (math.log(2.0), math.log(0.6 / period_s)),
            (math.log(0.2), math.log(0.15 / period_s)),
            (math.log(0.2), math.log(min(0.25 / period_s, max(self.largest_kp_1_s, 0.3)))),
        ]
        if mode is not None:
            highest_hz = 0.49 / period_s
            mode_hz = min(mode.frequency_hz, highest_hz)
            bounds += [
                (math.log(0.9 * mode_hz), math.log(min(1.1 * mode_hz, highest_hz))),
                (math.log(0.05), math.log(1.0)),
                (math.log(0.01), math.log(0.7)),
            ]
        low, high = np.array(bounds).T
        optimum = differential_evolution(
            self.cost,
            Bounds(low, high),
            seed=SEED,
            popsize=POPULATION,
            maxiter=GENERATIONS,
            tol=1e-4,
            polish=False,
        )
        return float(optimum.fun), np.asarray(optimum.x)


def _ms_excess(loop: Response, integrators: int, ms: float) -> float:
    """Logarithm of Ms over its bound, 0 below; an unstable loop has `UNSTABLE` more."""
    peak = float(np.max(1.0 / np.abs(1.0 + loop)))
    excess = max(0.0, math.log(peak / ms))
    return excess if is_stable(1.0 + loop, integrators) else UNSTABLE + excess
