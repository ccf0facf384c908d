"""When did a sequence of measured values change, given what each of them is worth?

    y_i = level + f(motion_i) + b (temperature_i - mean) + change * s_k(i) + e_i

f is a Gaussian process over the kind of motion: recordings of alike motions share what the model has wrong
for them, so only like is compared with like (Rasmussen and Williams 2006, section 2.7). s_k is a step from
recording k on, or a ramp that begins there. Test: generalised likelihood ratio over k (Willsky and Jones
1976; Lai 1995), the scale of the errors estimated on both sides of the change, so Student's t. Level of the
test: one false alarm in so many recordings at most, shared out evenly among all k and all indicators that are
judged (Bonferroni), so no threshold is tuned to data.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.stats import t as student

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

FEWEST_BEFORE, FEWEST_AFTER = 6, 2
"""Recordings; one alone that is off is an odd recording, and no change."""
OTHER_MOTION = 0.3
"""Of a feature of the motion: so far away what the model has wrong is another thing."""
WARM_K = 1.0
"""Temperatures that differ by less are one."""
PRIOR = 6.0
"""The errors from within the recordings count as so many degrees of freedom of their scale."""
MOST = 300
"""Recordings that are looked back on."""
SURE = 0.95


class Sequence(NamedTuple):
    """One indicator over the recordings, oldest first; all (n,) but the features."""

    values: Array
    errors: Array
    features: Array
    """(n, d): the kind of motion."""
    temperature_k: Array
    """NaN where none was recorded."""
    reach: float
    """Standard deviation of what another kind of motion adds."""
    least: float
    """A smaller change does not matter."""


class Alarm(NamedTuple):
    """The test's answer at the last recording."""

    change: float
    """Estimated step."""
    t: float
    """What of it goes beyond the least that matters, in its standard errors; signed."""
    needed: float
    """The t that counts as an alarm."""
    since: int
    """The first recording after the step that fits best."""

    @property
    def raised(self) -> bool:
        """Whether it is one."""
        return abs(self.t) > self.needed


class Onset(NamedTuple):
    """When it began, and how."""

    first: int
    """Most probable first recording that differs."""
    low: int
    high: int
    """95 % of the probability is within, both included."""
    ramp: float
    """Probability that it grows since then and did not step."""


def lengths(before_and_after: int) -> list[int]:
    """How many recordings lie after the steps that are judged: 2, 3, 4, 6, 8, 12, 16, ..."""
    found, length = [], FEWEST_AFTER
    while length <= before_and_after - FEWEST_BEFORE:
        found.append(length)
        power_of_two = length & (length - 1) == 0
        length = length + length // 2 if power_of_two else 2 ** length.bit_length()
    return found


def judged(sequence: Sequence, indicators: int, run_length: float) -> Alarm | None:
    """Whether the newest recordings lie elsewhere; None with too few recordings to say.

    `indicators`: how many are judged at each recording; `run_length`: recordings between false alarms.
    """
    n = len(sequence.values)
    after = lengths(n)
    if not after:
        return None
    solved = _Solved(sequence)
    level = 1.0 / (run_length * len(after) * max(indicators, 1))
    needed = float(student.isf(0.5 * level, n - 2 + PRIOR))
    best = Alarm(0.0, 0.0, needed, n)
    for length in after:
        change, error, _ = solved.fit(_step(n, n - length))
        t = math.copysign(max(abs(change) - sequence.least, 0.0) / error, change)
        if abs(t) >= abs(best.t):
            best = Alarm(change, t, needed, n - length)
    return best


def onset(sequence: Sequence) -> Onset:
    """When a change began that is there, with its probability over all recordings: posterior of k and form.

    Flat prior of k, step and ramp alike before they are seen; the scale of the errors integrated out.
    """
    n = len(sequence.values)
    solved = _Solved(sequence)
    firsts = list(range(1, n))
    weights = np.full((2, n), -np.inf)
    for k in firsts:
        for form, shape in enumerate((_step(n, k), _ramp(n, k))):
            if form == 1 and k == n - 1:
                continue  # the same as the step
            _, _, left = solved.fit(shape)
            weights[form, k] = -0.5 * (n - 2 + PRIOR) * math.log(left + PRIOR)
    posterior = np.exp(weights - weights.max())
    posterior /= posterior.sum()
    by_first = posterior.sum(axis=0)
    ramp = float(posterior[1].sum())
    order = np.argsort(-by_first)
    inside = order[: int(np.searchsorted(np.cumsum(by_first[order]), SURE)) + 1]
    first = int(np.argmax(posterior[int(ramp > 0.5)]))
    return Onset(first, int(min(inside.min(), first)), int(max(inside.max(), first)), ramp)


def moved(sequence: Sequence, first: int, *, ramp: bool) -> tuple[float, float, float]:
    """Value before, change up to the last recording and its standard error, where the onset is known."""
    n = len(sequence.values)
    shape = _ramp(n, first) if ramp else _step(n, first)
    solved = _Solved(sequence)
    slope, error, _ = solved.fit(shape)
    return solved.level(shape), slope * float(shape[-1]), error * float(shape[-1])


def covariance(sequence: Sequence) -> Array:
    """Of the values without a change, but for the scale, (n, n)."""
    apart = (sequence.features[:, None, :] - sequence.features) / OTHER_MOTION
    alike = np.exp(-0.5 * (apart**2).sum(axis=-1))
    total: Array = np.diag(sequence.errors**2) + sequence.reach**2 * alike
    warm = sequence.temperature_k
    if np.isfinite(warm).all() and float(np.ptp(warm)) >= WARM_K:
        # any slope over the temperature: what goes with it is not called a change
        off = warm - warm.mean()
        size = float(np.ptp(sequence.values)) + float(sequence.errors.max())
        total += np.outer(off, off) * (10.0 * size / float(np.ptp(warm))) ** 2
    return total


class _Solved:
    """A sequence behind the inverse of its covariance."""

    def __init__(self, sequence: Sequence) -> None:
        self._y = sequence.values
        n = len(self._y)
        total = covariance(sequence)
        total += np.eye(n) * 1e-9 * float(np.trace(total)) / n
        self._factor = cho_factor(total)

    def fit(self, shape: Array) -> tuple[float, float, float]:
        """Change, its standard error, and the sum of squares that is left, in their scale."""
        theta, errors, left = self._regress(shape)
        return float(theta[1]), float(errors[1]), left

    def level(self, shape: Array) -> float:
        """Value where the shape is nothing, of the motions as they were."""
        theta, _, _ = self._regress(shape)
        return float(theta[0])

    def _regress(self, shape: Array) -> tuple[Array, Array, float]:
        columns = np.stack((np.ones(len(shape)), shape), axis=1)
        weighted = cho_solve(self._factor, columns)
        inverse = np.linalg.inv(columns.T @ weighted)
        theta: Array = inverse @ (weighted.T @ self._y)
        rest = self._y - columns @ theta
        left = float(rest @ cho_solve(self._factor, rest))
        # never narrower than the recordings themselves say
        scale = max((left + PRIOR) / (len(rest) - 2 + PRIOR), 1.0)
        errors: Array = np.sqrt(scale * np.diag(inverse))
        return theta, errors, left


def _step(n: int, k: int) -> Array:
    return (np.arange(n) >= k).astype(np.float64)


def _ramp(n: int, k: int) -> Array:
    rising: Array = np.maximum(np.arange(n) - k + 1.0, 0.0)
    return rising
