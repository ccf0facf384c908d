"""Share of a residual's variance that its mean over the bins of a coordinate explains, cross-validated.

The mean of noise predicts no block that it was not computed from, so noise has a share of 0 however many bins
there are. Blocks are stretches of time, because neighbouring samples are alike in every coordinate.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array, Index
from reconcile.location.coordinates import Coordinate
from reconcile.regression.residual import Residual

BLOCK_S = 1.0
"""Length of a block, s: long against the correlation of the noise behind the filter (25 ms)."""
FOLDS = 8
"""Folds of the cross-validation; the blocks are dealt to them in turn."""
SHRINKAGE_SAMPLES = 25.0
"""Shrinkage of a bin's mean: it is computed as if 25 further samples were zero; chosen."""
LEAST_T = 2.5
"""Least t of a share: the blocks' mean gain, plain or as log ratio, over its standard error; chosen."""


class SamplesInUse(NamedTuple):
    """The samples in use of all recordings, one after the other; arrays (m,)."""

    values: Array
    """The residual, in phase with the motion."""
    direction: Array
    """Direction of the last motion, +1 or -1; 0 before the first."""
    block: Index
    blocks: int
    total: float
    """Sum of squares."""


class ExplainedShare(NamedTuple):
    """What a coordinate explains of a residual; arrays by bin."""

    share: float
    by_direction: bool
    mean: Array
    """Mean residual; where `by_direction`, of the residual times the direction of motion."""
    errors: Array
    """Standard error of each mean, from its spread over the blocks."""
    counts: Array


def samples_in_use(residuals: Sequence[Residual], values: Sequence[Array]) -> SamplesInUse:
    """Join the samples in use of `values`, one array (n,) for each recording."""
    blocks, first = [], 0
    for residual in residuals:
        n = len(residual.used)
        count = max(round(n * residual.data.period_s / BLOCK_S), 2 * FOLDS // len(residuals), 1)
        blocks.append((first + np.arange(n) * count // n)[residual.used])
        first += count
    joined = np.concatenate([of[residual.used] for of, residual in zip(values, residuals, strict=True)])
    direction = np.concatenate([residual.data.motion.last_direction[residual.used] for residual in residuals])
    return SamplesInUse(joined, direction, np.concatenate(blocks), first, float(joined @ joined))


def bins_in_use(coordinate: Coordinate, residuals: Sequence[Residual]) -> Index:
    """The bins (m,) of the samples in use."""
    return np.concatenate(
        [bins[residual.used] for bins, residual in zip(coordinate.bins, residuals, strict=True)]
    )


def explained_share(
    samples: SamplesInUse, bins: Index, bin_count: int, *, signed_by_direction: bool
) -> ExplainedShare:
    """Cross-validate the mean over `bins` (m,), 0 to `bin_count` - 1; samples of bin -1 do not count.

    `signed_by_direction`: the mean is of the residual times the direction of motion.
    """
    has_bin, blocks = bins >= 0, samples.blocks
    block, values = samples.block[has_bin], samples.values[has_bin]
    weight = samples.direction[has_bin] if signed_by_direction else np.ones(len(block))
    cell = block * bin_count + bins[has_bin]
    counts, sums = (
        np.bincount(cell, addend, blocks * bin_count).reshape(blocks, bin_count).astype(np.float64)
        for addend in (weight**2, weight * values)
    )
    gain = _cross_validated_gain(sums, counts)
    squares = np.bincount(samples.block, samples.values**2, blocks)
    not_empty = squares > 0.0
    share = max(float(gain.sum()) / samples.total, 0.0) if samples.total > 0.0 else 0.0
    # two statistics, because a gain in a few outlying blocks passes neither: its own spread is as large
    log_ratio = -np.log(np.maximum(1.0 - gain[not_empty] / squares[not_empty], 1e-12))
    is_significant = max(mean_over_error(gain[not_empty]), mean_over_error(log_ratio)) >= LEAST_T
    totals = counts.sum(axis=0)
    mean = sums.sum(axis=0) / np.maximum(totals, 1e-9)
    errors = np.sqrt(((sums - mean * counts) ** 2).sum(axis=0)) / np.maximum(totals, 1e-9)
    return ExplainedShare(share if is_significant else 0.0, signed_by_direction, mean, errors, totals)


def mean_over_error(values: Array) -> float:
    """Student's t of a mean: over its standard error; 0 of fewer than two values."""
    if len(values) < 2:
        return 0.0
    return float(values.mean() / (values.std(ddof=1) / math.sqrt(len(values)) + 1e-300))


def _cross_validated_gain(sums: Array, counts: Array) -> Array:
    """Reduction of each block's sum of squares by the means of the other folds, (blocks,)."""
    fold = np.arange(len(sums)) % FOLDS
    gain = np.zeros(len(sums))
    for k in range(FOLDS):
        held_out = fold == k
        mean = sums[~held_out].sum(axis=0) / (counts[~held_out].sum(axis=0) + SHRINKAGE_SAMPLES)
        gain[held_out] = 2.0 * sums[held_out] @ mean - counts[held_out] @ mean**2
    return gain
