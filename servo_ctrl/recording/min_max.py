"""Decimates without losing a peak: keeps minimum and maximum of every bucket of rows."""

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array
from kernels.jit import kernel

Indices = NDArray[np.int64]


@kernel
def extremes(rows: Array, columns: Indices, bucket: int, lead: int) -> Indices:
    """Return the row indices of the extremes of each column (k,) in each bucket of rows, (k, buckets, 2).

    `rows` (n, channels) is C-contiguous. The first bucket lacks `lead` < `bucket` rows, and the last one may
    be short. The two extremes are in time order; equal where all values are equal, -1 where all are NaN.
    """
    count = rows.shape[0]
    found = np.full((len(columns), (count + lead + bucket - 1) // bucket, 2), -1, dtype=np.int64)
    for place in range(found.shape[1]):
        for row in range(max(place * bucket - lead, 0), min((place + 1) * bucket - lead, count)):
            for k in range(len(columns)):
                value = rows[row, columns[k]]
                if np.isnan(value):
                    continue
                if found[k, place, 0] < 0:
                    found[k, place, 0] = row
                    found[k, place, 1] = row
                    continue
                if value < rows[found[k, place, 0], columns[k]]:
                    found[k, place, 0] = row
                if value > rows[found[k, place, 1], columns[k]]:
                    found[k, place, 1] = row
        for k in range(len(columns)):
            if found[k, place, 0] > found[k, place, 1]:
                found[k, place, 0], found[k, place, 1] = found[k, place, 1], found[k, place, 0]
    return found


def min_max(rows: Array, columns: Indices, bucket: int, lead: int = 0) -> Array:
    """Return the values at `extremes`, (k, buckets, 2); NaN where a bucket has no number."""
    found = extremes(rows, columns, bucket, lead)
    if not len(rows):
        return np.full(found.shape, np.nan)
    values = rows[found, columns[:, np.newaxis, np.newaxis]]
    return np.where(found < 0, np.nan, values)


def thinned(x: Array, y: Array, stretches: int) -> tuple[Array, Array]:
    """Keep at most two points of each of `stretches` equal stretches; a stretch of NaN stays a gap."""
    if len(y) <= 2 * stretches:
        return x, y
    bucket = -(-len(y) // stretches)
    rows = np.ascontiguousarray(y, dtype=np.float64)[:, np.newaxis]
    found = extremes(rows, np.zeros(1, dtype=np.int64), bucket, 0)[0]
    kept = np.unique(np.where(found < 0, bucket * np.arange(len(found))[:, np.newaxis], found))
    return x[kept], y[kept]


def bucket_rows(span: int, width: int) -> int:
    """Return the rows per bucket for which any `span` rows touch at most `width` buckets."""
    if span <= width:
        return 1
    # buckets start at multiples of their length, so a span may touch one bucket more than it fills
    return -(-span // (width - 1))
