"""Generalised regression neural network over one input (Feng et al. 2015, section 4.3; Specht 1991).

    A*(a) = sum A_i exp(-(a - a_i)^2 / 2 s^2) / sum exp(-(a - a_i)^2 / 2 s^2)

The spread s is chosen by leave-one-out (ours; the paper does not say).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

SPREADS_TRIED = 60


def regression(points: Array, values: Array, spread: float, at: Array) -> Array:
    """The network's output (n,) at `at` (n,) from `points` (k,) and `values` (k,); spread > 0."""
    exponent = -0.5 * ((at[:, np.newaxis] - points) / spread) ** 2
    exponent -= exponent.max(axis=1, keepdims=True)  # far from all points the weights would underflow
    weight = np.exp(exponent)
    return np.asarray(weight @ values / weight.sum(axis=1))


def leave_one_out_spread(points: Array, values: Array) -> float:
    """The spread at which the network best foretells each point from the others, RMS; k >= 2 points."""
    gaps = np.diff(points)
    candidates = np.geomspace(0.2 * gaps.min(), points[-1] - points[0], SPREADS_TRIED)
    others = ~np.eye(len(points), dtype=bool)

    def misfit(spread: float) -> float:
        foretold = [
            regression(points[row], values[row], spread, points[i : i + 1])[0] for i, row in enumerate(others)
        ]
        return float(np.mean((np.array(foretold) - values) ** 2))

    return float(min(candidates, key=misfit))
