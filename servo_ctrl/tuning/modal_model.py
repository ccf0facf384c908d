"""A modal model of a measured plant: rigid mass with viscous friction, modes, and delay.

    P(s) = [ r / (s^2 + b s) + sum over k of c_k / (s^2 + 2 z_k w_k s + w_k^2) ] exp(-s tau)

as the ticks see it: the set point goes out one period after its tick and is held, the position is sampled.
Poles and delay are those of both outputs, motor and scale; the residues are each output's own (Ewins, Modal
Testing, chapter 4). Fitted by least squares on the relative error, each line weighted by its coherence;
the residues are solved for (variable projection, Golub and Pereyra 1973). A mode is added where it
explains what is left, as long as it does.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import find_peaks, medfilt

from kernels.arrays import Array
from servo_ctrl.tuning.frequency_response import FrequencyResponse, Response

ALIASES = 4
"""Terms of the sum by which sampling folds the spectrum, on either side. Chosen, as all numbers here."""
MODES, CANDIDATES = 3, 3
LOWEST_HZ, LEAST_LINES = 6.0, 20
"""Below, friction is no damping: the lines there are measured, and not fitted."""
LEAST_COHERENCE = 0.5
ERROR_FLOOR = 0.02
"""Least standard error of a line, a share of it: the model is not better than that."""
AROUND, LEAST_SHARE = 25, 0.3
"""Lines around an antiresonance, and the share of what is usual there below which an error counts less."""
DELAYS = (0.0, 1.0, 3.0, 6.0, 12.0)
"""Periods of delay from which the fit begins."""
GAIN = 0.7
"""A mode must bring the squares down to this share."""
PROMINENT = 0.25
"""Share of the rigid response at its frequency that a mode must have to be called a resonance."""
DAMPING, RESONANT = (1e-4, 0.7), 0.5
"""Bounds of a fitted damping ratio, and the one from which on a mode shows no peak that is a resonance."""


class StructuralMode(NamedTuple):
    """A pole pair, with its residues in position per force."""

    frequency_hz: float
    damping_ratio: float
    motor_1_kg: float
    scale_1_kg: float


class ModalModel(NamedTuple):
    """What was fitted. `motor_1_kg`, `scale_1_kg`: r, one over the moved mass, as either output shows it."""

    period_s: float
    motor_1_kg: float
    scale_1_kg: float
    friction_1_s: float
    """b: viscous friction over mass."""
    delay_s: float
    """tau, beside the one period until a set point goes out."""
    modes: tuple[StructuralMode, ...]
    error: float
    """Root mean square of the relative error over all lines that were used."""

    @property
    def mass_kg(self) -> float:
        """The moved mass."""
        return 1.0 / self.motor_1_kg

    def motor(self, frequency_hz: Array, shift: float = 1.0) -> Response:
        """Position of the motor per force, m/N, (n,); with all modes `shift` times as high."""
        return self._output(frequency_hz, shift, self.motor_1_kg, [m.motor_1_kg for m in self.modes])

    def scale(self, frequency_hz: Array, shift: float = 1.0) -> Response:
        """Likewise of the scale."""
        return self._output(frequency_hz, shift, self.scale_1_kg, [m.scale_1_kg for m in self.modes])

    def _output(self, frequency_hz: Array, shift: float, rigid: float, residues: list[float]) -> Response:
        poles = [(shift * mode.frequency_hz, mode.damping_ratio) for mode in self.modes]
        columns = _columns(frequency_hz, self.period_s, self.friction_1_s, self.delay_s, poles)
        return np.asarray(columns @ np.array([rigid, *residues]))


def resonances(model: ModalModel) -> tuple[StructuralMode, ...]:
    """The modes that stand out of the rigid response of the motor or of the scale."""
    found = []
    for mode in model.modes:
        size = max(abs(mode.motor_1_kg / model.motor_1_kg), abs(mode.scale_1_kg / model.scale_1_kg))
        peak = size / (2.0 * mode.damping_ratio)
        if peak >= PROMINENT and mode.damping_ratio < RESONANT:
            found.append(mode)
    return tuple(found)


def held_modes(model: ModalModel) -> tuple[tuple[float, float], ...]:
    """Frequency (Hz) and damping ratio of what still swings while the motor is held: its antiresonances.

    They are the zeros of the motor's response: r times the product of all D_k, and for each mode c_k
    (s^2 + b s) times the product of the others, with D_k = s^2 + 2 z_k w_k s + w_k^2.
    """
    polynomials = []
    for mode in model.modes:
        w = 2.0 * math.pi * mode.frequency_hz
        polynomials.append(np.array([1.0, 2.0 * mode.damping_ratio * w, w * w]))
    zeros = np.array([model.motor_1_kg])
    for own in polynomials:
        zeros = np.polymul(zeros, own)
    for index, mode in enumerate(model.modes):
        term = mode.motor_1_kg * np.array([1.0, model.friction_1_s, 0.0])
        for other, own in enumerate(polynomials):
            if other != index:
                term = np.polymul(term, own)
        zeros = np.polyadd(zeros, term)
    roots = [complex(root) for root in np.roots(zeros)]
    found = [(abs(root) / (2.0 * math.pi), -root.real / abs(root)) for root in roots if root.imag > 0.0]
    highest_hz = 0.5 / model.period_s
    return tuple(
        sorted((hz, damping) for hz, damping in found if hz < highest_hz and 0.0 <= damping < RESONANT)
    )


def _columns(
    frequency_hz: Array,
    period_s: float,
    friction_1_s: float,
    delay_s: float,
    poles: list[tuple[float, float]],
) -> Response:
    """(n, 1 + modes): what each residue is multiplied by."""
    w = 2.0 * math.pi * frequency_hz
    s = 1j * (w[:, np.newaxis] + 2.0 * math.pi / period_s * np.arange(-ALIASES, ALIASES + 1))
    passage = np.exp(-s * (period_s + delay_s)) * (1.0 - np.exp(-1j * w * period_s))[:, np.newaxis]
    passage /= s * period_s
    terms = [passage / (s * s + friction_1_s * s)]
    for at_hz, damping_ratio in poles:
        wk = 2.0 * math.pi * at_hz
        terms.append(passage / (s * s + 2.0 * damping_ratio * wk * s + wk * wk))
    return np.stack([term.sum(axis=1) for term in terms], axis=1)


class _Problem:
    """The lines that are used of either output, and the least squares over them."""

    def __init__(self, response: FrequencyResponse, period_s: float) -> None:
        self.period_s = period_s
        self.frequency_hz, self.targets, self.weights = [], [], []
        for target, coherence in (
            (response.motor, response.motor_coherence),
            (response.scale, response.scale_coherence),
        ):
            used = (coherence > LEAST_COHERENCE) & (response.frequency_hz > LOWEST_HZ)
            error = response.relative_error(coherence)[used]
            self.frequency_hz.append(response.frequency_hz[used])
            self.targets.append(target[used])
            self.weights.append(
                1.0 / np.hypot(error, ERROR_FLOOR) / _size(target[used], self.frequency_hz[-1])
            )

    def columns(self, values: Array) -> list[Response]:
        """Of either output: what its residues are multiplied by."""
        poles = _poles_of(values)
        return [
            _columns(at_hz, self.period_s, values[0] ** 2, values[1], poles) for at_hz in self.frequency_hz
        ]

    def solve(self, values: Array) -> tuple[list[Array], list[Array]]:
        """Residues of either output, and the weighted residuals."""
        residues, residuals = [], []
        for columns, target, weight in zip(self.columns(values), self.targets, self.weights, strict=True):
            weighted = columns * weight[:, np.newaxis]
            stacked = np.concatenate((weighted.real, weighted.imag))
            goal = np.concatenate(((target * weight).real, (target * weight).imag))
            solution = np.asarray(np.linalg.lstsq(stacked, goal, rcond=None)[0], dtype=np.float64)
            residues.append(solution)
            residuals.append(stacked @ solution - goal)
        return residues, residuals

    def fit(self, start: Array) -> Array:
        """The poles and the delay from a start."""
        modes = (len(start) - 2) // 2
        nyquist_hz = 0.5 / self.period_s
        lower = [0.0, -0.9 * self.period_s, *[math.log(0.5), math.log(DAMPING[0])] * modes]
        upper = [30.0, 0.05, *[math.log(nyquist_hz), math.log(DAMPING[1])] * modes]
        solution = least_squares(
            self.residuals,
            np.clip(start, np.add(lower, 1e-9), np.subtract(upper, 1e-9)),
            bounds=(lower, upper),
            x_scale=np.array([1.0, self.period_s, *[0.05, 0.5] * modes]),
            max_nfev=60,
        )
        return np.asarray(solution.x)

    def residuals(self, values: Array) -> Array:
        """Of both outputs, with the best residues."""
        return np.concatenate(self.solve(values)[1])

    def squares(self, values: Array) -> float:
        """Mean square of the weighted residuals."""
        return float(np.mean(self.residuals(values) ** 2))

    def candidates(self, values: Array) -> list[float]:
        """Where what is left of the accelerance is largest, Hz."""
        residues, _ = self.solve(values)
        found: list[tuple[float, float]] = []
        for at_hz, columns, target, own in zip(
            self.frequency_hz, self.columns(values), self.targets, residues, strict=True
        ):
            left = np.abs(target - columns @ own) * at_hz**2
            peaks, _ = find_peaks(np.concatenate(([0.0], left, [0.0])))
            found += [(float(left[k - 1]), float(at_hz[k - 1])) for k in peaks]
        found.sort(reverse=True)
        kept: list[float] = []
        for _, at in found:
            if all(abs(math.log(at / other)) > 0.05 for other in kept):
                kept.append(at)
        return kept[:CANDIDATES]


def _size(response: Response, frequency_hz: Array) -> Array:
    """What an error is a share of: |P|, at an antiresonance what is usual around it."""
    accelerance = np.abs(response) * frequency_hz**2
    usual = medfilt(accelerance, min(AROUND, len(accelerance) - 1 | 1))
    return np.asarray(np.maximum(accelerance, LEAST_SHARE * usual) / frequency_hz**2)


def _poles_of(values: Array) -> list[tuple[float, float]]:
    rest = values[2:]
    return [(math.exp(at), math.exp(damping)) for at, damping in zip(rest[::2], rest[1::2], strict=True)]


def fit_modal_model(response: FrequencyResponse, period_s: float) -> ModalModel:
    """The model with as many modes as explain something. Raises ValueError where too few lines are usable."""
    problem = _Problem(response, period_s)
    fewest = min(map(len, problem.frequency_hz))
    if fewest < LEAST_LINES:
        raise ValueError(
            f"only {fewest} of {len(response.frequency_hz)} lines are coherent: the excitation is too weak, "
            "or something else moves the axis"
        )
    starts = [problem.fit(np.array([1.0, periods * period_s])) for periods in DELAYS]
    starts.sort(key=problem.squares)
    values = starts[0]
    squares = problem.squares(values)
    for _ in range(MODES):
        tried = [
            problem.fit(np.concatenate((start, [math.log(at_hz), math.log(damping)])))
            for start in (starts[:2] if len(values) == 2 else [values])
            for at_hz in problem.candidates(start)
            for damping in (0.02, 0.2)
        ]
        if not tried:
            break
        best = min(tried, key=problem.squares)
        if problem.squares(best) > GAIN * squares:
            break
        values, squares = best, problem.squares(best)
    (motor, scale), _ = problem.solve(values)
    modes = tuple(
        StructuralMode(at_hz, damping, float(in_motor), float(in_scale))
        for (at_hz, damping), in_motor, in_scale in zip(_poles_of(values), motor[1:], scale[1:], strict=True)
    )
    model = ModalModel(
        period_s,
        float(motor[0]),
        float(scale[0]),
        float(values[0] ** 2),
        float(values[1]),
        tuple(sorted(modes, key=lambda mode: mode.frequency_hz)),
        0.0,
    )
    if not (model.motor_1_kg > 0.0 and model.scale_1_kg > 0.0):
        raise ValueError("the response is not that of a mass: look at the coherence, and at the signs")
    misfit = np.concatenate(
        [
            np.abs(predicted / target - 1.0)
            for predicted, target in zip(
                (model.motor(problem.frequency_hz[0]), model.scale(problem.frequency_hz[1])),
                problem.targets,
                strict=True,
            )
        ]
    )
    return model._replace(error=float(np.sqrt(np.mean(misfit**2))))
