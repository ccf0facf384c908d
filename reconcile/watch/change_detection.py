"""Detects and dates a change in a sequence of measured values, each with its standard error.

    y_i = level + f(motion_i) + b (temperature_i - mean) + change * s_k(i) + e_i

f is a Gaussian process over features of the motion: recordings of similar motions share the error of the
model, so that similar motions are compared (Rasmussen and Williams 2006, section 2.7). s_k is a step
at recording k, or a ramp that begins there. The test is a generalised likelihood ratio over k (Willsky and
Jones 1976; Lai 1995) with the error scale estimated on both sides, hence Student's t. Its level allows at
most one false alarm in `run_length` recordings, shared among all k and all tested indicators (Bonferroni), so
that no threshold is tuned to data.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.stats import t as student

from kernels.arrays import Array

MIN_BEFORE, MIN_AFTER = 6, 2
"""Least recordings before and after a change; a single deviating recording is an outlier."""
MOTION_SCALE = 0.3
"""Length scale of the Gaussian process in features of the motion (`motion_features`)."""
MIN_TEMPERATURE_RANGE_K = 1.0
"""Below this range the slope over temperature is not estimated."""
PRIOR_FREEDOM = 6.0
"""Degrees of freedom that the errors estimated within the recordings contribute to the error scale."""
MAX_RECORDINGS = 300
"""Most recordings in a test."""
CREDIBLE_PROBABILITY = 0.95
"""Posterior probability of the interval of an onset."""
MIN_RECORDINGS = MIN_BEFORE + MIN_AFTER


class IndicatorSeries(NamedTuple):
    """One indicator over the recordings, oldest first; arrays (n,)."""

    values: Array
    errors: Array
    features: Array
    """(n, d): features of the motion."""
    temperature_k: Array
    """NaN where none was recorded."""
    motion_spread: float
    """Standard deviation of f: by how much another kind of motion shifts the value."""
    min_change: float
    """A smaller change is not reported."""


class Alarm(NamedTuple):
    """The result of the test at the newest recording, for the step that fits best."""

    t: float
    """The part of the estimated step beyond `min_change`, in standard errors; signed."""
    threshold: float
    """The t above which it is an alarm."""

    @property
    def raised(self) -> bool:
        """Whether the test rejects the hypothesis of no change."""
        return abs(self.t) > self.threshold


class Onset(NamedTuple):
    """The onset of a change, and its form."""

    first: int
    """Most probable first recording that differs."""
    low: int
    high: int
    """Bounds of the 95 % credible interval, both included."""
    ramp_probability: float
    """Else it is a step."""


class ChangeSize(NamedTuple):
    """The size of a change with a known onset."""

    before: float
    """Value before the change."""
    change: float
    """Up to the newest recording."""
    standard_error: float
    """Of the change."""


def lengths_after_step(recordings: int) -> list[int]:
    """Return the numbers of recordings after the tested steps, of all `recordings`: 2, 3, 4, 6, 8, 12, ..."""
    lengths, length = [], MIN_AFTER
    while length <= recordings - MIN_BEFORE:
        lengths.append(length)
        is_power_of_two = length & (length - 1) == 0
        length = length + length // 2 if is_power_of_two else 2 ** length.bit_length()
    return lengths


def newest_alarm(series: IndicatorSeries, indicators: int, run_length: float) -> Alarm | None:
    """Test whether the newest recordings differ; return None with too few recordings.

    `indicators`: how many are tested at each recording; `run_length`: recordings between false alarms.
    """
    n = len(series.values)
    lengths = lengths_after_step(n)
    if not lengths:
        return None
    regression = _WhitenedRegression(series)
    level = 1.0 / (run_length * len(lengths) * max(indicators, 1))
    threshold = float(student.isf(0.5 * level, n - 2 + PRIOR_FREEDOM))
    best = Alarm(0.0, threshold)
    for length in lengths:
        fit = regression.fit(_step(n, n - length))
        t = math.copysign(max(abs(fit.change) - series.min_change, 0.0) / fit.error, fit.change)
        if abs(t) >= abs(best.t):
            best = Alarm(t, threshold)
    return best


def onset(series: IndicatorSeries) -> Onset:
    """Return the posterior of the onset k and the form of a detected change.

    The prior is flat over k, step and ramp; the error scale is integrated out.
    """
    n = len(series.values)
    regression = _WhitenedRegression(series)
    log_posterior = np.full((2, n), -np.inf)
    for k in range(1, n):
        for form, shape in enumerate((_step(n, k), _ramp(n, k))):
            if form == 1 and k == n - 1:
                continue  # a ramp of one recording is a step
            squares = regression.fit(shape).residual_squares + PRIOR_FREEDOM
            log_posterior[form, k] = -0.5 * (n - 2 + PRIOR_FREEDOM) * math.log(squares)
    posterior = np.exp(log_posterior - log_posterior.max())
    posterior /= posterior.sum()
    by_first = posterior.sum(axis=0)
    ramp_probability = float(posterior[1].sum())
    order = np.argsort(-by_first)
    credible = order[: int(np.searchsorted(np.cumsum(by_first[order]), CREDIBLE_PROBABILITY)) + 1]
    first = int(np.argmax(posterior[int(ramp_probability > 0.5)]))
    low, high = int(min(credible.min(), first)), int(max(credible.max(), first))
    return Onset(first, low, high, ramp_probability)


def change_size(series: IndicatorSeries, first: int, *, is_ramp: bool) -> ChangeSize:
    """Return the size of a change from recording `first` on, a ramp or a step."""
    n = len(series.values)
    shape = _ramp(n, first) if is_ramp else _step(n, first)
    fit = _WhitenedRegression(series).fit(shape)
    return ChangeSize(fit.level, fit.change * float(shape[-1]), fit.error * float(shape[-1]))


def covariance(series: IndicatorSeries) -> Array:
    """Return the covariance (n, n) of the values without a change, up to the error scale."""
    distance = (series.features[:, None, :] - series.features) / MOTION_SCALE
    similarity = np.exp(-0.5 * (distance**2).sum(axis=-1))
    total: Array = np.diag(series.errors**2) + series.motion_spread**2 * similarity
    temperature_k = series.temperature_k
    if np.isfinite(temperature_k).all() and float(np.ptp(temperature_k)) >= MIN_TEMPERATURE_RANGE_K:
        # a slope over temperature with a wide prior: a dependence on temperature is not a change
        deviation_k = temperature_k - temperature_k.mean()
        size = float(np.ptp(series.values)) + float(series.errors.max())
        total += np.outer(deviation_k, deviation_k) * (10.0 * size / float(np.ptp(temperature_k))) ** 2
    return total


class _ChangeFit(NamedTuple):
    """A fitted level before the change, and the change times its shape."""

    level: float
    change: float
    error: float
    """Standard error of the change."""
    residual_squares: float
    """Weighted by the inverse covariance."""


class _WhitenedRegression:
    """Generalised least squares of a series on a level and a shape."""

    def __init__(self, series: IndicatorSeries) -> None:
        self._y = series.values
        n = len(self._y)
        total = covariance(series)
        total += np.eye(n) * 1e-9 * float(np.trace(total)) / n
        self._factor = cho_factor(total)

    def fit(self, shape: Array) -> _ChangeFit:
        columns = np.stack((np.ones(len(shape)), shape), axis=1)
        weighted = cho_solve(self._factor, columns)
        inverse = np.linalg.inv(columns.T @ weighted)
        theta: Array = inverse @ (weighted.T @ self._y)
        residual = self._y - columns @ theta
        residual_squares = float(residual @ cho_solve(self._factor, residual))
        # at least the errors estimated within the recordings
        scale = max((residual_squares + PRIOR_FREEDOM) / (len(residual) - 2 + PRIOR_FREEDOM), 1.0)
        error = float(np.sqrt(scale * inverse[1, 1]))
        return _ChangeFit(float(theta[0]), float(theta[1]), error, residual_squares)


def _step(n: int, k: int) -> Array:
    return (np.arange(n) >= k).astype(np.float64)


def _ramp(n: int, k: int) -> Array:
    rising: Array = np.maximum(np.arange(n) - k + 1.0, 0.0)
    return rising
