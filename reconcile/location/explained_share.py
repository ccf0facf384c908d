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
"""Blocks are dealt to the folds in turn."""
SHRINKAGE_SAMPLES = 25.0
"""Shrinkage of a bin's mean: it is computed as if so many further samples were zero."""
LEAST_STANDARD_ERRORS = 2.5
"""Least significance of a share: the blocks' mean gain, plain or as log ratio, over its standard error."""


class Samples(NamedTuple):
    """The samples in use of all recordings, one after the other; arrays (m,)."""

    values: Array
    """The residual, in phase with the motion."""
    direction: Array
    """Direction of the last motion, +1 or -1; 0 before the first."""
    block: Index
    blocks: int
    total: float
    """Sum of squares."""


class Share(NamedTuple):
    """What a coordinate explains of a residual; arrays by bin."""

    share: float
    by_direction: bool
    mean: Array
    """Mean residual; where `by_direction`, of the residual times the direction of motion."""
    errors: Array
    """Standard error of each mean, from its spread over the blocks."""
    counts: Array


def samples(residuals: Sequence[Residual], values: Sequence[Array]) -> Samples:
    """Join the samples in use of `values`, one array (n,) for each recording."""
    blocks, first = [], 0
    for residual in residuals:
        n = len(residual.used)
        count = max(round(n * residual.data.period_s / BLOCK_S), 2 * FOLDS // len(residuals), 1)
        blocks.append((first + np.arange(n) * count // n)[residual.used])
        first += count
    kept = np.concatenate([of[residual.used] for of, residual in zip(values, residuals, strict=True)])
    direction = np.concatenate([residual.data.motion.last_direction[residual.used] for residual in residuals])
    return Samples(kept, direction, np.concatenate(blocks), first, float(kept @ kept))


def used_bins(coordinate: Coordinate, residuals: Sequence[Residual]) -> Index:
    """The bins (m,) of the samples in use."""
    return np.concatenate(
        [bins[residual.used] for bins, residual in zip(coordinate.bins, residuals, strict=True)]
    )


def share(samples_in_use: Samples, bins: Index, count: int, *, signed_by_direction: bool) -> Share:
    """Cross-validate the mean over `bins` (m,), 0 to `count` - 1; samples of bin -1 are left out.

    `signed_by_direction`: the mean is of the residual times the direction of motion.
    """
    inside, blocks = bins >= 0, samples_in_use.blocks
    block, values = samples_in_use.block[inside], samples_in_use.values[inside]
    weight = samples_in_use.direction[inside] if signed_by_direction else np.ones(len(block))
    cell = block * count + bins[inside]
    number, sums = (
        np.bincount(cell, of, blocks * count).reshape(blocks, count).astype(np.float64)
        for of in (weight**2, weight * values)
    )
    gain = _cross_validated_gain(sums, number)
    squares = np.bincount(samples_in_use.block, samples_in_use.values**2, blocks)
    full = squares > 0.0
    part = max(float(gain.sum()) / samples_in_use.total, 0.0) if samples_in_use.total > 0.0 else 0.0
    # two statistics, because a gain in a few wild blocks passes neither: its own spread is as large
    logs = -np.log(np.maximum(1.0 - gain[full] / squares[full], 1e-12))
    significant = max(significance(gain[full]), significance(logs)) >= LEAST_STANDARD_ERRORS
    mean = sums.sum(axis=0) / np.maximum(number.sum(axis=0), 1e-9)
    error = np.sqrt(((sums - mean * number) ** 2).sum(axis=0)) / np.maximum(number.sum(axis=0), 1e-9)
    return Share(part if significant else 0.0, signed_by_direction, mean, error, number.sum(axis=0))


def significance(gains: Array) -> float:
    """Mean of `gains` over its standard error; 0 of fewer than two."""
    if len(gains) < 2:
        return 0.0
    return float(gains.mean() / (gains.std(ddof=1) / math.sqrt(len(gains)) + 1e-300))


def _cross_validated_gain(sums: Array, number: Array) -> Array:
    """Reduction of each block's sum of squares by the means of the other folds, (blocks,)."""
    fold = np.arange(len(sums)) % FOLDS
    gain = np.zeros(len(sums))
    for k in range(FOLDS):
        own = fold == k
        mean = sums[~own].sum(axis=0) / (number[~own].sum(axis=0) + SHRINKAGE_SAMPLES)
        gain[own] = 2.0 * sums[own] @ mean - number[own] @ mean**2
    return gain
