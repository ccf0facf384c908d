"""Computes accuracy and repeatability of positioning of a linear axis by ISO 230-2:2014, clause 3.

Deviation x_ij = actual minus target position; i: target, j: run, up and down: direction of approach.

    mean deviation      xm_i = mean_j x_ij, of each direction; both: (xm_i up + xm_i down) / 2
    reversal            B_i = xm_i up - xm_i down;  B = max |B_i|
    estimator           s_i = sqrt(sum_j (x_ij - xm_i)^2 / (n - 1)), of each direction
    repeatability       R_i = 4 s_i, of each direction;
                        both: max(2 s_i up + 2 s_i down + |B_i|, R_i up, R_i down)
    systematic          E = max xm_i - min xm_i, of each direction, and over both
    mean bidirectional  M = max - min of the means of both directions
    accuracy            A = max(xm_i + 2 s_i) - min(xm_i - 2 s_i), of each direction, and over both

R is the largest of the R_i. The standard requires at least five runs and five targets a metre; here two runs
suffice, because s_i needs no more.
"""

from typing import NamedTuple

import numpy as np

from kernels.arrays import Array

DIRECTIONS = 2


class OneWay(NamedTuple):
    """Figures of one direction of approach, metres."""

    repeatability_m: float
    """R."""
    systematic_m: float
    """E."""
    accuracy_m: float
    """A."""


class Positioning(NamedTuple):
    """Figures of an axis, metres; the arrays are (targets,)."""

    mean_m: Array
    """xm_i up and down, (targets, 2)."""
    estimator_m: Array
    """s_i up and down, (targets, 2)."""
    reversal_at_m: Array
    """B_i, with its sign."""
    repeatability_at_m: Array
    """R_i of both directions."""
    reversal_m: float
    """B."""
    reversal_mean_m: float
    """Mean of the B_i, with its sign."""
    repeatability_m: float
    """R of both directions."""
    systematic_m: float
    """E of both directions."""
    mean_bidirectional_m: float
    """M."""
    accuracy_m: float
    """A of both directions."""
    up: OneWay
    down: OneWay


def positioning(deviation_m: Array) -> Positioning:
    """Evaluate deviations (runs, targets, 2); the last index is 0 for an approach from below, 1 from above.

    Raises:
        ValueError: another shape, fewer than two runs, no target, or a deviation that is not finite.

    """
    if deviation_m.ndim != 3 or deviation_m.shape[2] != DIRECTIONS:
        raise ValueError(f"deviations must be (runs, targets, 2), not {deviation_m.shape}")
    if deviation_m.shape[0] < 2 or deviation_m.shape[1] < 1:
        raise ValueError(f"{deviation_m.shape[0]} runs of {deviation_m.shape[1]} targets: 2 of 1 are needed")
    if not np.isfinite(deviation_m).all():
        raise ValueError("a deviation is not finite")
    mean_m = deviation_m.mean(axis=0)
    estimator_m = deviation_m.std(axis=0, ddof=1)
    reversal_at_m = mean_m[:, 0] - mean_m[:, 1]
    one_way_m = 4.0 * estimator_m
    both_m = 2.0 * estimator_m.sum(axis=1) + np.abs(reversal_at_m)
    repeatability_at_m = np.maximum(both_m, one_way_m.max(axis=1))
    return Positioning(
        mean_m=mean_m,
        estimator_m=estimator_m,
        reversal_at_m=reversal_at_m,
        repeatability_at_m=repeatability_at_m,
        reversal_m=float(np.abs(reversal_at_m).max()),
        reversal_mean_m=float(reversal_at_m.mean()),
        repeatability_m=float(repeatability_at_m.max()),
        systematic_m=float(np.ptp(mean_m)),
        mean_bidirectional_m=float(np.ptp(mean_m.mean(axis=1))),
        accuracy_m=_accuracy_m(mean_m, estimator_m),
        up=_one_way(mean_m[:, 0], estimator_m[:, 0]),
        down=_one_way(mean_m[:, 1], estimator_m[:, 1]),
    )


def _one_way(mean_m: Array, estimator_m: Array) -> OneWay:
    return OneWay(
        repeatability_m=float(4.0 * estimator_m.max()),
        systematic_m=float(np.ptp(mean_m)),
        accuracy_m=_accuracy_m(mean_m, estimator_m),
    )


def _accuracy_m(mean_m: Array, estimator_m: Array) -> float:
    return float((mean_m + 2.0 * estimator_m).max() - (mean_m - 2.0 * estimator_m).min())
