"""Statistics that compare two models by their squares in short blocks.

One outlying block can carry neither of the two: the mean log ratio of the blocks' squares and the
self-normalised sum of their differences. The threshold grows with the number of candidates (Bonferroni).
"""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from kernels.arrays import Array

CORRELATED_BLOCKS = 20
"""Neighbouring short blocks whose noise may be correlated: 0.5 s."""
LEAST_LONG_RUN_RATIO = 0.2
"""Least long-run sum of squares over the plain one: bounds the reduction by negative correlation; chosen."""


def log_ratio_t(better: Array, worse: Array, counted: NDArray[np.bool_] | None = None) -> float:
    """Mean log ratio of the blocks' squares over its standard error; positive if `better` is smaller.

    Arrays (blocks,) in the order of time; only the `counted` blocks enter, all by default.
    """
    compared = (better > 0.0) & (worse > 0.0) & (True if counted is None else counted)
    log_ratio = np.log(worse[compared] / better[compared])
    if len(log_ratio) < 2 or not log_ratio.any():
        return 0.0
    series = np.zeros(len(better))
    series[compared] = log_ratio - log_ratio.mean()
    standard_error = math.sqrt(_long_run_squares(series)) / len(log_ratio) + 1e-12
    return float(log_ratio.mean() / standard_error)


def self_normalised_sum(better: Array, worse: Array, counted: NDArray[np.bool_] | None = None) -> float:
    """Sum of the blocks' differences over the root of the sum of their squares; one event alone gives 1.

    For symmetric noise its distribution is no wider than the normal one, however long the tails (Efron 1969).
    It is sensitive to effects that are large in few blocks, `log_ratio_t` to those that are small in all.
    """
    reduction = worse - better if counted is None else np.where(counted, worse - better, 0.0)
    return float(reduction.sum() / (math.sqrt(_long_run_squares(reduction)) + 1e-300))


def _long_run_squares(series: Array) -> float:
    """Long-run sum of squares of a correlated series (Newey and West 1987, equation 5)."""
    total = float(series @ series)
    for lag in range(1, min(CORRELATED_BLOCKS, len(series) - 1) + 1):
        total += 2.0 * (1.0 - lag / (CORRELATED_BLOCKS + 1.0)) * float(series[lag:] @ series[:-lag])
    return max(total, LEAST_LONG_RUN_RATIO * float(series @ series))


def bonferroni_threshold(candidates: int, blocks: int, false_alarm: float) -> float:
    """Student's t that the best of `candidates` exceeds by chance with probability `false_alarm`."""
    return float(student.isf(false_alarm / max(candidates, 1), max(blocks - 1, 1)))
