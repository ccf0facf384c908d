"""Gains, feedforward and notch from a measured plant: the stiffest axis that keeps a stated Ms.

Stiffness is judged by what a step of force does to the axis: the largest deviation, from P / (1 + L) by the
inverse Fourier integral, and its integral over time, 1 / (kp ki) (Astrom and Hagglund, Advanced PID Control,
section 4.3). Constraints:

- Ms of the loop at the amplifier's set point, all paths together, at most the stated one;
- with every mode of the model 7 % lower or higher, stable, and Ms at most a quarter above it;
- with 30 % more or less mass stable, Ms at most half above it (play that opens takes mass off the motor);
- the velocity loop by itself stable, Ms at most 2.5: the position loop may be open at a limit;
- the noise of the encoders' last digit in the force at most 1 % of its limit.

A search (differential evolution, with a seed of its own) over velocity gain, integral, position gain, and
with a notch its frequency, width and depth. A notch that is not worth a tenth is left out.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import Bounds, differential_evolution

from kernels.arrays import Array
from servo_ctrl.control.compensation import notch
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.control.types import Output
from servo_ctrl.tuning import loop as loops
from servo_ctrl.tuning.frequency_response import FrequencyResponse, Response
from servo_ctrl.tuning.loop import Margins, Plant
from servo_ctrl.tuning.modal_model import ModalModel, StructuralMode, held_modes, resonances

SHIFTS, SHIFTED_MS = (0.93, 1.07), 1.25
LOADS, LOADED_MS = (1.0 / 0.7, 1.0 / 1.3), 1.5
VELOCITY_MS = 2.5
NOISE_SHARE = 0.01
STEP_S, STEP_POINTS = 0.3, 60
"""How long the axis is looked at behind a step of force, and at how many instants."""
SWINGS_ON, SHAPED_TO_HZ = 0.1, 150.0
"""Damping ratio and frequency up to which a shaper is worth its delay."""
WORTH = 0.1
"""Of the cost, a logarithm, by which a notch must be better. Chosen, as the numbers above."""
INFEASIBLE = 1e3
SEED, POPULATION, GENERATIONS = 24, 10, 60
DIGITS = 3
"""Of a proposed value."""


class NotchValues(NamedTuple):
    """Keys of the notch section."""

    frequency_hz: float
    damping_ratio: float
    depth: float


class ShaperValues(NamedTuple):
    """Keys of the input shaper's section."""

    frequency_hz: float
    damping_ratio: float


class Proposal(NamedTuple):
    """Keys of the machine file, and what they make of the loop."""

    kp_1_s: float
    kv_n_s_m: float
    ki_n_m: float
    velocity_feedforward: float
    acceleration_feedforward_kg: float
    notch: NotchValues | None
    params: AxisParams
    """Those of the tick with these values."""
    margins: Margins
    compliance_m_n: float
    """Its peak."""
    resonances: tuple[StructuralMode, ...]
    shaper: ShaperValues | None
    """Against what swings while the axis is held. Told, not applied: all axes of a path need the same."""


class EncoderSteps(NamedTuple):
    """The last digit of the motor's encoder and of the feedback, metres; 0 where it is not to count."""

    motor_m: float
    feedback_m: float


class _Search:
    """The plants that a candidate is judged on."""

    def __init__(
        self,
        params: AxisParams,
        model: ModalModel,
        measured: FrequencyResponse,
        ms: float,
        steps: EncoderSteps,
        largest_kp_1_s: float,
    ) -> None:
        self.params, self.model, self.ms, self.steps = params, model, ms, steps
        self.largest_kp_1_s = largest_kp_1_s
        scale = params.position_loop.scale_feedback
        self.plant = loops.plant_of(model, measured, scale_feedback=scale)
        w = 2.0 * math.pi * self.plant.frequency_hz
        times_s = np.geomspace(2.0 * params.period_s, STEP_S, STEP_POINTS)
        self.kernel = 2.0 / math.pi * np.sin(np.outer(times_s, w)) / w * np.gradient(w)
        moves = SHIFTS if model.modes else ()
        self.shifted = [loops.plant_of(model, None, scale_feedback=scale, shift=shift) for shift in moves]

    def with_values(self, x: Array) -> AxisParams:
        """The parameters of a candidate: logarithms of kv / m, ki / kv, kp; notch frequency, width, depth."""
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
        """Logarithm of what a force does, or how far a candidate is from what is allowed."""
        params = self.with_values(x)
        loop = loops.loop_of(params, self.plant)
        excess = self._excess(loop, self.ms)
        if excess > 0.0:
            return INFEASIBLE + excess
        excess = self._excess(loops.velocity_loop_of(params, self.plant), VELOCITY_MS)
        for gain in LOADS:
            excess += self._excess(gain * loop, LOADED_MS * self.ms)
        for plant in self.shifted:
            excess += self._excess(loops.loop_of(params, plant), SHIFTED_MS * self.ms)
        excess += max(0.0, math.log(self.noise_n(params, loop) / (NOISE_SHARE * params.limits.force_n)))
        if excess > 0.0:
            return 0.5 * INFEASIBLE + excess
        integral = params.position_loop.kp_1_s * params.velocity_loop.ki_n_m
        return math.log(self.step_peak(loop)) - 0.25 * math.log(integral)

    def _excess(self, loop: Response, ms: float) -> float:
        """How far a loop is above its Ms, 0 where it is not; one that is not stable is far."""
        peak = float(np.max(1.0 / np.abs(1.0 + loop)))
        excess = max(0.0, math.log(peak / ms))
        return excess if loops.is_stable(loop) else 10.0 + excess

    def step_peak(self, loop: Response) -> float:
        """Largest deviation behind a step of 1 N, m: 2 / pi times the integral of Re G sin(w t) / w."""
        return float(np.max(np.abs(self.kernel @ (self.plant.feedback / (1.0 + loop)).real)))

    def compliance(self, loop: Response) -> float:
        """The peak of |P / (1 + L)|, m/N."""
        return float(np.max(np.abs(self.plant.feedback / (1.0 + loop))))

    def noise_n(self, params: AxisParams, loop: Response) -> float:
        """RMS of the force by the last digits of the encoders, each a step of equal distribution."""
        z = loops.on_circle(self.plant.frequency_hz, params.period_s)
        outer = loops.notch_response(params.notch, z) * loops.velocity_law(params, z) / (1.0 + loop)
        paths = (
            (loops.velocity_estimate(params, z), self.steps.motor_m),
            (loops.position_law(params, z), self.steps.feedback_m),
        )
        width = np.gradient(self.plant.frequency_hz) * 2.0 * params.period_s
        squares = sum(
            float(np.sum(np.abs(outer * path) ** 2 * width)) * step**2 / 12.0 for path, step in paths
        )
        return math.sqrt(max(squares, 1e-30))

    def best(self, mode: StructuralMode | None) -> tuple[float, Array]:
        """Cost and values of the best candidate, with a notch at a mode or without one."""
        period_s = self.params.period_s
        bounds: list[tuple[float, float]] = [
            (math.log(2.0), math.log(0.6 / period_s)),
            (math.log(0.2), math.log(0.15 / period_s)),
            (math.log(0.2), math.log(min(0.25 / period_s, max(self.largest_kp_1_s, 0.3)))),
        ]
        if mode is not None:
            highest_hz = 0.49 / period_s
            at_hz = min(mode.frequency_hz, highest_hz)
            bounds += [
                (math.log(0.9 * at_hz), math.log(min(1.1 * at_hz, highest_hz))),
                (math.log(0.05), math.log(1.0)),
                (math.log(0.01), math.log(0.7)),
            ]
        low, high = np.array(bounds).T
        found = differential_evolution(
            self.cost,
            Bounds(low, high),
            seed=SEED,
            popsize=POPULATION,
            maxiter=GENERATIONS,
            tol=1e-4,
            polish=False,
        )
        return float(found.fun), np.asarray(found.x)


def propose(
    params: AxisParams,
    model: ModalModel,
    measured: FrequencyResponse,
    ms: float,
    steps: EncoderSteps,
    *,
    largest_kp_1_s: float = math.inf,
) -> Proposal:
    """The best setting of a cst axis, with a position gain below a largest one.

    Raises ValueError where no setting keeps the constraints.
    """
    if params.output != int(Output.FORCE):
        raise ValueError("only mode cst has a velocity loop that can be tuned here")
    search = _Search(params, model, measured, ms, steps, largest_kp_1_s)
    cost, values = search.best(None)
    for mode in resonances(model):
        if mode.frequency_hz >= 0.49 / params.period_s:
            continue
        other_cost, other = search.best(mode)
        if other_cost < cost - WORTH:
            cost, values = other_cost, other
    if cost >= 0.5 * INFEASIBLE:
        raise ValueError(f"no gains keep Ms at {ms:g} with this plant: look at its resonances and its delay")
    rounded = np.log([_rounded(value) for value in np.exp(values)])
    if search.cost(rounded) >= 0.5 * INFEASIBLE:
        rounded[:3] -= 0.01  # rounding has taken it across
    return _proposal(search, rounded)


def _proposal(search: _Search, values: Array) -> Proposal:
    found = search.with_values(values)
    kv, ki = _rounded(found.velocity_loop.kv_n_s_m), _rounded(found.velocity_loop.ki_n_m)
    kp, mass_kg = _rounded(found.position_loop.kp_1_s), _rounded(search.model.mass_kg)
    filters = None
    if len(values) > 3:
        filters = NotchValues(*(_rounded(float(value)) for value in np.exp(values[3:])))
    params = found._replace(
        position_loop=found.position_loop._replace(kp_1_s=kp),
        velocity_loop=found.velocity_loop._replace(kv_n_s_m=kv, ki_n_m=ki),
        feedforward=found.feedforward._replace(velocity=1.0, acceleration_kg=mass_kg),
        notch=notch.NEUTRAL if filters is None else notch.biquad(*filters, found.period_s),
    )
    loop = loops.loop_of(params, search.plant)
    return Proposal(
        kp,
        kv,
        ki,
        1.0,
        mass_kg,
        filters,
        params,
        loops.margins_of(loop, search.plant.frequency_hz),
        search.compliance(loop),
        resonances(search.model),
        _shaper(search.model),
    )


def _shaper(model: ModalModel) -> ShaperValues | None:
    """For the lowest mode that swings on while the motor is held; None where all die away quickly."""
    for hz, damping in held_modes(model):
        if damping < SWINGS_ON and hz < SHAPED_TO_HZ and resonances(model):
            return ShaperValues(_rounded(hz), _rounded(damping))
    return None


def judged(
    params: AxisParams, model: ModalModel, measured: FrequencyResponse
) -> tuple[Plant, Margins, float]:
    """Plant, margins and peak compliance (m/N) of a setting on the measured plant."""
    plant = loops.plant_of(model, measured, scale_feedback=params.position_loop.scale_feedback)
    loop = loops.loop_of(params, plant)
    compliance = float(np.max(np.abs(plant.feedback / (1.0 + loop))))
    return plant, loops.margins_of(loop, plant.frequency_hz), compliance


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
