"""Divides recordings into the blocks that a fit leaves out in turn.

Neighbouring samples have the same noise, so a model is judged by whole blocks of consecutive samples.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Index
from reconcile.catalogue.kinds import RegressionData

BLOCK_S = 0.5
"""Length of a block, s, unless the recordings give fewer than FEWEST_BLOCKS."""
FEWEST_BLOCKS = 80
"""Blocks that short recordings are divided into at least, so that cross-validation has its folds."""
LEAST_SHARE_IN_USE = 0.5
"""Share of the time in use below which the axis mostly stands; chosen."""
MOST_BLOCKS = 400
"""Blocks of long recordings at most: each has the products of all columns, 130 MB for this number."""


def blocks_of(
    datasets: Sequence[RegressionData], used: Sequence[NDArray[np.bool_]]
) -> tuple[list[Index], Index]:
    """Return the block of each sample, (n,) by recording, numbered throughout, and each block's recording.

    Blocks are cut from the time of the recordings. Where the axis mostly stands and too few of them would be
    in use for folds, they are cut from the time in use, as if the standstills were not recorded.
    """
    whole = [np.ones(len(data.time_s), dtype=np.bool_) for data in datasets]
    by_time = _equal_blocks(datasets, whole)
    in_use = sum(len(np.unique(block[own])) for block, own in zip(by_time[0], used, strict=True))
    mostly_stands = sum(own.sum() for own in used) < LEAST_SHARE_IN_USE * sum(map(len, used))
    return _equal_blocks(datasets, used) if mostly_stands and 0 < in_use < FEWEST_BLOCKS else by_time


def _equal_blocks(
    datasets: Sequence[RegressionData], counted: Sequence[NDArray[np.bool_]]
) -> tuple[list[Index], Index]:
    """Blocks with equally many `counted` samples (n,); the others belong to the block before them."""
    counts = [int(own.sum()) for own in counted]
    total_s = sum(count * data.period_s for count, data in zip(counts, datasets, strict=True))
    length_s = max(min(BLOCK_S, total_s / FEWEST_BLOCKS), total_s / MOST_BLOCKS)
    block_of, recordings, first = [], [], 0
    for index, (data, own, samples) in enumerate(zip(datasets, counted, counts, strict=True)):
        count = max(round(samples * data.period_s / length_s), 1)
        place = np.maximum(np.cumsum(own) - 1, 0)
        block_of.append(first + place * count // max(samples, 1))
        recordings += [index] * count
        first += count
    return block_of, np.array(recordings)
