"""Share of a difference that its mean over the bins of a coordinate explains, on blocks left out of the mean.

A mean over noise predicts nothing that it has not seen, so noise gives a share of nothing, however many bins.
Blocks are stretches of time and not samples: neighbours are alike whatever the coordinate.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.locate_coordinates import Coordinate
    from reconcile.rests import Rest

    Array = NDArray[np.float64]
    Index = NDArray[np.int64]

BLOCK_S = 1.0
FOLDS = 8
FEW = 25.0
"""A mean is drawn to nothing as if so many more samples had been zero."""
CHANCE = 2.5
"""A share whose blocks' mean gain, plain or as a log ratio, is below so many standard errors is nothing."""


class Samples(NamedTuple):
    """The samples in use of all recordings, one after the other, (m,)."""

    values: Array
    """The difference, in phase with the motion."""
    side: Array
    """Direction of the last motion, +1 or -1; 0 before the first."""
    block: Index
    blocks: int
    total: float
    """Sum of squares."""


class Share(NamedTuple):
    """What a coordinate explains."""

    share: float
    by_direction: bool
    mean: Array
    """Mean of the difference in each bin, turned round with the direction where `by_direction`."""
    errors: Array
    """Standard error of each, from its spread over the blocks."""
    counts: Array


def samples(rests: Sequence[Rest], values: Sequence[Array]) -> Samples:
    """Of `values`, one array (n,) a recording."""
    blocks, first = [], 0
    for rest in rests:
        n = len(rest.used)
        count = max(round(n * rest.scene.period_s / BLOCK_S), 2 * FOLDS // len(rests), 1)
        blocks.append((first + np.arange(n) * count // n)[rest.used])
        first += count
    kept = np.concatenate([of[rest.used] for of, rest in zip(values, rests, strict=True)])
    side = np.concatenate([rest.scene.motion.last_direction[rest.used] for rest in rests])
    return Samples(kept, side, np.concatenate(blocks), first, float(kept @ kept))


def joined(coordinate: Coordinate, rests: Sequence[Rest]) -> Index:
    """The bins of the samples in use."""
    return np.concatenate([bins[rest.used] for bins, rest in zip(coordinate.bins, rests, strict=True)])


def share(given: Samples, bins: Index, count: int, *, turned: bool) -> Share:
    """`turned`: the difference is turned round with the direction of motion; a bin of -1 is none."""
    inside = bins >= 0
    block, place, values = given.block, bins, given.values
    weight = given.side if turned else None
    if not inside.all():
        block, place, values = block[inside], place[inside], values[inside]
        weight = None if weight is None else weight[inside]
    cell = block * count + place
    shape = (given.blocks, count)
    size = given.blocks * count

    def by_cell(weights: Array) -> Array:
        return np.asarray(np.bincount(cell, weights, size), dtype=np.float64).reshape(shape)

    if weight is None:
        number, sums = by_cell(np.ones(len(cell))), by_cell(values)
    else:
        number, sums = by_cell(weight**2), by_cell(weight * values)
    gain = _unseen(sums, number)
    squares = np.asarray(np.bincount(given.block, given.values**2, given.blocks), dtype=np.float64)
    full = squares > 0.0
    part = max(float(gain.sum()) / given.total, 0.0) if given.total > 0.0 else 0.0
    # a gain in a few wild blocks is seen by neither alone: its own spread is as large as it is
    logs = -np.log(np.maximum(1.0 - gain[full] / squares[full], 1e-12))
    believed = max(significance(gain[full]), significance(logs)) >= CHANCE
    mean = sums.sum(axis=0) / np.maximum(number.sum(axis=0), 1e-9)
    error = np.sqrt(((sums - mean * number) ** 2).sum(axis=0)) / np.maximum(number.sum(axis=0), 1e-9)
    return Share(part if believed else 0.0, turned, mean, error, number.sum(axis=0))


def significance(gains: Array) -> float:
    """Mean in units of its standard error."""
    if len(gains) < 2:
        return 0.0
    return float(gains.mean() / (gains.std(ddof=1) / math.sqrt(len(gains)) + 1e-300))


def _unseen(sums: Array, number: Array) -> Array:
    """What the means of the other folds take off the squares of each block, (blocks,)."""
    fold = np.arange(len(sums)) % FOLDS
    gain = np.zeros(len(sums))
    for k in range(FOLDS):
        own = fold == k
        mean = sums[~own].sum(axis=0) / (number[~own].sum(axis=0) + FEW)
        gain[own] = 2.0 * sums[own] @ mean - number[own] @ mean**2
    return gain
