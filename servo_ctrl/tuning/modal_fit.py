"""Fit of a modal model to the measured responses of motor and scale.

Least squares on the relative error, each line weighted by its coherence. Poles and delay are iterated; the
residues, in which the model is linear, are solved for at each step (variable projection, Golub and Pereyra
1973). A mode is added at a peak of the residual as long as it explains enough of it.
"""

import math

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import find_peaks, medfilt

from kernels.arrays import Array, rms
from servo_ctrl.control.modal_model import ModalModel, StructuralMode, residue_columns
from servo_ctrl.tuning.frequency_response import FrequencyResponse, Response

MOST_MODES, CANDIDATES = 3, 3
"""Most modes of a model, and residual peaks tried for the next one. Chosen, as are the numbers below."""
LOWEST_HZ, LEAST_LINES = 6.0, 20
"""Lines below are not fitted, because presliding friction is not viscous damping; fewest lines of a fit."""
LEAST_COHERENCE = 0.5
ERROR_FLOOR = 0.02
"""Least relative standard error of a line: the model itself is not better than that."""
NEIGHBOURS, ANTIRESONANCE_SHARE = 25, 0.3
"""Lines around an antiresonance, and the share of their median that is the least scale of an error."""
START_DELAYS = (0.0, 1.0, 3.0, 6.0, 12.0)
"""Delays, in periods, from which the fit starts."""
KEPT_SQUARES = 0.7
"""A further mode must reduce the sum of squares to this share."""
DAMPING_BOUNDS = (1e-4, 0.7)
"""Bounds of a fitted damping ratio."""


class _FitProblem:
    """The usable lines of motor and scale, and the least squares over them.

    The iterated values are the square root of b, tau, and for each mode the logarithms of frequency (Hz) and
    damping ratio.
    """

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
                1.0 / np.hypot(error, ERROR_FLOOR) / _error_scale(target[used], self.frequency_hz[-1])
            )

    def columns(self, values: Array) -> list[Response]:
        """Responses of motor and scale by unit residues, (n, 1 + modes) each."""
        poles = _poles(values)
        return [
            residue_columns(line_hz, self.period_s, values[0] ** 2, values[1], poles)
            for line_hz in self.frequency_hz
        ]

    def solve(self, values: Array) -> tuple[list[Array], list[Array]]:
        """Best residues of either output, and the weighted residuals, real and imaginary parts."""
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
        """Iterate friction, delay and poles from a start."""
        modes = (len(start) - 2) // 2
        nyquist_hz = 0.5 / self.period_s
        lower = [0.0, -0.9 * self.period_s, *[math.log(0.5), math.log(DAMPING_BOUNDS[0])] * modes]
        upper = [30.0, 0.05, *[math.log(nyquist_hz), math.log(DAMPING_BOUNDS[1])] * modes]
        solution = least_squares(
            self.residuals,
            np.clip(start, np.add(lower, 1e-9), np.subtract(upper, 1e-9)),
            bounds=(lower, upper),
            x_scale=np.array([1.0, self.period_s, *[0.05, 0.5] * modes]),
            max_nfev=60,
        )
        return np.asarray(solution.x)

    def residuals(self, values: Array) -> Array:
        """Weighted residuals of both outputs with the best residues."""
        return np.concatenate(self.solve(values)[1])

    def squares(self, values: Array) -> float:
        """Mean square of the weighted residuals."""
        return float(np.mean(self.residuals(values) ** 2))

    def mode_candidates(self, values: Array) -> list[float]:
        """Frequencies (Hz) of the largest peaks of the residual accelerance, at most `CANDIDATES`."""
        residues, _ = self.solve(values)
        found: list[tuple[float, float]] = []
        for line_hz, columns, target, own in zip(
            self.frequency_hz, self.columns(values), self.targets, residues, strict=True
        ):
            residual = np.abs(target - columns @ own) * line_hz**2
            peaks, _ = find_peaks(np.concatenate(([0.0], residual, [0.0])))
            found += [(float(residual[k - 1]), float(line_hz[k - 1])) for k in peaks]
        found.sort(reverse=True)
        distinct: list[float] = []
        for _, peak_hz in found:
            if all(abs(math.log(peak_hz / other)) > 0.05 for other in distinct):
                distinct.append(peak_hz)
        return distinct[:CANDIDATES]


def _error_scale(response: Response, frequency_hz: Array) -> Array:
    """What an error is relative to: |P|; at an antiresonance, a share of the median of its neighbours."""
    accelerance = np.abs(response) * frequency_hz**2
    median = medfilt(accelerance, min(NEIGHBOURS, len(accelerance) - 1 | 1))
    return np.asarray(np.maximum(accelerance, ANTIRESONANCE_SHARE * median) / frequency_hz**2)


def _poles(values: Array) -> list[tuple[float, float]]:
    """Frequency (Hz) and damping ratio of each mode."""
    logarithms = values[2:]
    return [
        (math.exp(frequency), math.exp(damping))
        for frequency, damping in zip(logarithms[::2], logarithms[1::2], strict=True)
    ]


def fit_modal_model(response: FrequencyResponse, period_s: float) -> ModalModel:
    """Fit a model with as many modes as explain enough of the residual, at most `MOST_MODES`.

    Raises ValueError where too few lines are usable, or where the response is not that of a mass.
    """
    problem = _FitProblem(response, period_s)
    fewest = min(map(len, problem.frequency_hz))
    if fewest < LEAST_LINES:
        raise ValueError(
            f"only {fewest} of {len(response.frequency_hz)} lines are coherent: the excitation is too weak, "
            "or a disturbance moves the axis"
        )
    starts = [problem.fit(np.array([1.0, periods * period_s])) for periods in START_DELAYS]
    starts.sort(key=problem.squares)
    values = starts[0]
    squares = problem.squares(values)
    for _ in range(MOST_MODES):
        tried = [
            problem.fit(np.concatenate((start, [math.log(mode_hz), math.log(damping)])))
            for start in (starts[:2] if len(values) == 2 else [values])
            for mode_hz in problem.mode_candidates(start)
            for damping in (0.02, 0.2)
        ]
        if not tried:
            break
        best = min(tried, key=problem.squares)
        if problem.squares(best) > KEPT_SQUARES * squares:
            break
        values, squares = best, problem.squares(best)
    (motor, scale), _ = problem.solve(values)
    modes = tuple(
        StructuralMode(mode_hz, damping, float(in_motor), float(in_scale))
        for (mode_hz, damping), in_motor, in_scale in zip(_poles(values), motor[1:], scale[1:], strict=True)
    )
    model = ModalModel(
        period_s,
        float(motor[0]),
        float(scale[0]),
        friction_1_s=float(values[0] ** 2),
        delay_s=float(values[1]),
        modes=tuple(sorted(modes, key=lambda mode: mode.frequency_hz)),
        error=0.0,
    )
    if not (model.motor_1_kg > 0.0 and model.scale_1_kg > 0.0):
        raise ValueError("the response is not that of a mass: check the coherence and the signs")
    predictions = model.motor(problem.frequency_hz[0]), model.scale(problem.frequency_hz[1])
    misfit = np.concatenate(
        [
            np.abs(predicted / target - 1.0)
            for predicted, target in zip(predictions, problem.targets, strict=True)
        ]
    )
    return model._replace(error=rms(misfit))
