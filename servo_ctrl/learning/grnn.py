"""Generalised regression neural network over one input (Feng et al. 2015, section 4.3; Specht 1991).

    A*(a) = sum A_i exp(-(a - a_i)^2 / 2 s^2) / sum exp(-(a - a_i)^2 / 2 s^2)

Leave-one-out cross-validation selects the spread s (the paper gives no rule).
"""

import numpy as np

from kernels.arrays import Array

CANDIDATE_SPREADS = 60
"""Number of candidate spreads, in equal ratios from a fifth of the least gap to the whole range; chosen."""


def regression(points: Array, values: Array, spread: float, at: Array) -> Array:
    """Evaluate the network at `at` (n,) from `points` and `values` (k,); spread > 0."""
    exponent = -0.5 * ((at[:, np.newaxis] - points) / spread) ** 2
    exponent -= exponent.max(axis=1, keepdims=True)  # the largest weight is 1, however far the points are
    weight = np.exp(exponent)
    return np.asarray(weight @ values / weight.sum(axis=1))


def leave_one_out_spread(points: Array, values: Array) -> float:
    """Spread of least mean squared error when each of k >= 2 points is predicted from the others."""
    gaps = np.diff(points)
    candidates = np.geomspace(0.2 * gaps.min(), points[-1] - points[0], CANDIDATE_SPREADS)
    others = ~np.eye(len(points), dtype=bool)

    def cross_validated_error(spread: float) -> float:
        predicted = [
            regression(points[row], values[row], spread, points[i : i + 1])[0] for i, row in enumerate(others)
        ]
        return float(np.mean((np.array(predicted) - values) ** 2))

    return float(min(candidates, key=cross_validated_error))
