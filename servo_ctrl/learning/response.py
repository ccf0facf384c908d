"""Identifies the response of the error to the pulse from a few strokes, and finds the best pulse by it.

Near the best stroke so far, the error is assumed to be linear in the pulse,

    e(t) = e_best(t) - int_0^t h(t - u) (p(u) - p_best(u)) du,

and the response h is fitted to the strokes at this acceleration. It includes the tracking loop and the
presliding of the guide, which acts partly as a spring. h is piecewise linear between knots; its curvature is
penalised, and so is its deviation from the response at the previous acceleration. This is not in the paper.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array, rms
from servo_ctrl.learning.types import Pulse

KNOTS_S = np.array([0.0, 1.0, 2.0, 4.0, 8.0, 12, 18, 26, 36, 50, 70, 95, 130, 180, 250, 350, 500, 800]) * 1e-3
"""Knots of the response, seconds; chosen: dense at first, where the tracking loop acts."""
CURVATURE_WEIGHT = 1e-3
PRIOR_WEIGHT = 1e-3
"""Weights of curvature and of deviation from the previous response, relative to the strokes; chosen."""
SEARCH_ROUNDS_MAX = 60
"""Bounds the rounds of the compass search; chosen."""
SEARCH_STEP_MIN = 0.004
"""Share of a value below which the compass search ends; chosen."""
GRID_STARTS = 16
GRID_WIDTHS = 6
"""Grid of starting points for the second trapezoid: start times and widths; chosen."""


class TriedStroke(NamedTuple):
    """A completed stroke."""

    pulse: Pulse
    error_m: Array
    """(reversals, n), positive where the axis lags."""


class PulseResponse(NamedTuple):
    """The response, and the bounds of the pulse."""

    knot_values: Array
    """(knots,): values of the response h at its knots, dimensionless."""
    rise_s: float
    period_s: float
    amplitude_min_m_s: float
    amplitude_max_m_s: float


def pulse_samples(pulse: Pulse, response: PulseResponse, samples: int) -> Array:
    """p(t) of both trapezoids at t = 0, T, 2 T, ..., (samples,), m/s, limited to A_max."""
    time_s = np.arange(samples) * response.period_s

    def trapezoid(start_s: float, duration_s: float) -> Array:
        since_s = time_s - start_s
        return np.asarray(np.clip(np.minimum(since_s, duration_s - since_s) / response.rise_s, 0.0, 1.0))

    main = pulse.amplitude_m_s * trapezoid(0.0, pulse.duration_s)
    trailing = trapezoid(pulse.trailing_start_s, pulse.trailing_duration_s)
    total = main + pulse.trailing_amplitude_m_s * trailing
    return np.asarray(np.clip(total, -response.amplitude_max_m_s, response.amplitude_max_m_s))


def convolved(response: Array, samples: Array, period_s: float) -> Array:
    """Integral of h(t - u) p(u) over u at the samples, (n,)."""
    return np.convolve(response, samples)[: len(samples)] * period_s


def basis_of(samples: int, period_s: float) -> Array:
    """Basis of the response, (n, knots): each column is 1 at its knot and 0 at the others."""
    time_s = np.arange(samples) * period_s
    return np.stack([np.interp(time_s, KNOTS_S, column) for column in np.eye(len(KNOTS_S))], axis=1)


def fit_response(strokes: Sequence[TriedStroke], best: TriedStroke, response: PulseResponse) -> PulseResponse:
    """Fit the response to the differences of the strokes from the best one."""
    samples = best.error_m.shape[1]
    basis = basis_of(samples, response.period_s)
    curvature = np.diff(np.eye(len(KNOTS_S)), n=2, axis=0)
    rows, values = [], []
    reference = pulse_samples(best.pulse, response, samples)
    for stroke in strokes:
        change = pulse_samples(stroke.pulse, response, samples) - reference
        scale_m_s = np.abs(change).max()
        if scale_m_s > 0.0:
            columns = [convolved(hat, change, response.period_s) for hat in basis.T]
            rows.append(np.stack(columns, axis=1) / scale_m_s)
            values.append((best.error_m - stroke.error_m).mean(axis=0) / scale_m_s)
    if not rows:
        return response
    scale = np.sqrt(sum(float(np.sum(row**2)) for row in rows) / len(KNOTS_S))
    rows += [CURVATURE_WEIGHT**0.5 * scale * curvature, PRIOR_WEIGHT**0.5 * scale * np.eye(len(KNOTS_S))]
    values += [np.zeros(len(curvature)), PRIOR_WEIGHT**0.5 * scale * response.knot_values]
    matrix, target = np.concatenate(rows), np.concatenate(values)
    # normal equations, well posed by PRIOR_WEIGHT; fast, because the cycle shares the interpreter
    return response._replace(knot_values=np.linalg.solve(matrix.T @ matrix, matrix.T @ target))


def rms_m(error_m: Array) -> float:
    """Return the cost: RMS of the error, m. Unlike J, the mean |e|, it penalises single peaks."""
    return rms(error_m)


def best_stroke(strokes: Sequence[TriedStroke]) -> TriedStroke:
    """The stroke of least RMS error."""
    return min(strokes, key=lambda stroke: rms_m(stroke.error_m))


def best_pulse(
    best: TriedStroke, response: PulseResponse, start: Pulse, free: Sequence[str]
) -> tuple[Pulse, float]:
    """The pulse of least predicted error near `start`, and that error, m RMS; only the fields `free` change.

    A compass search whose steps are proportional to the values.
    """
    samples = best.error_m.shape[1]
    h = basis_of(samples, response.period_s) @ response.knot_values
    reference = pulse_samples(best.pulse, response, samples)

    def predicted_m(pulse: Pulse) -> float:
        change = pulse_samples(pulse, response, samples) - reference
        return rms_m(best.error_m - convolved(h, change, response.period_s))

    span_s, limit_m_s = samples * response.period_s, response.amplitude_max_m_s
    longest_s = max(span_s, 2.0 * response.rise_s)
    bounds = {
        "duration_s": (2.0 * response.rise_s, longest_s),
        "amplitude_m_s": (response.amplitude_min_m_s, limit_m_s),
        "trailing_start_s": (0.0, span_s),
        "trailing_duration_s": (2.0 * response.rise_s, longest_s),
        "trailing_amplitude_m_s": (-limit_m_s, limit_m_s),
    }
    return _compass(start, predicted_m, {name: bounds[name] for name in free})


def _compass(
    start: Pulse, cost: Callable[[Pulse], float], bounds: dict[str, tuple[float, float]]
) -> tuple[Pulse, float]:
    best, lowest = start, cost(start)
    relative_step = 0.3
    for _ in range(SEARCH_ROUNDS_MAX):
        moved = False
        for name, (low, high) in bounds.items():
            value = getattr(best, name)
            unit = max(abs(value), 0.02 * (high - low))
            for step in (relative_step * unit, -relative_step * unit):
                tried = best._replace(**{name: min(max(value + step, low), high)})
                if (cost_there := cost(tried)) < lowest:
                    best, lowest, moved = tried, cost_there, True
                    break
        if not moved:
            relative_step *= 0.5
            if relative_step < SEARCH_STEP_MIN:
                break
    return best, lowest


def with_trailing(best: TriedStroke, response: PulseResponse) -> Pulse:
    """The best stroke's pulse with the second trapezoid, of a grid, that predicts the least error.

    Amplitudes by least squares. The result is a starting point for the search.
    """
    samples = best.error_m.shape[1]
    h = basis_of(samples, response.period_s) @ response.knot_values
    error_m = best.error_m.mean(axis=0)
    span_s, limit_m_s = samples * response.period_s, response.amplitude_max_m_s
    candidates = []
    widths_s = np.geomspace(2.0 * response.rise_s, max(0.6 * span_s, 2.0 * response.rise_s), GRID_WIDTHS)
    for begin_s in np.linspace(0.25 * best.pulse.duration_s, 0.8 * span_s, GRID_STARTS).tolist():
        for width_s in widths_s.tolist():
            full = pulse_samples(Pulse(0.0, 0.0, begin_s, width_s, limit_m_s), response, samples)
            effect_m = convolved(h, full, response.period_s)
            share = float(np.clip(error_m @ effect_m / max(float(effect_m @ effect_m), 1e-30), -1.0, 1.0))
            residual_m = rms_m(error_m - share * effect_m)
            candidates.append((residual_m, (*best.pulse[:2], begin_s, width_s, share * limit_m_s)))
    return Pulse(*min(candidates)[1])
