"""Long series made short for a picture without losing a peak: the least and the greatest of each stretch."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


def thinned(x: Array, y: Array, stretches: int) -> tuple[Array, Array]:
    """At most two points of each of so many stretches, where they were; a stretch of NaN stays a gap."""
    if len(y) <= 2 * stretches:
        return x, y
    starts = np.linspace(0, len(y), stretches, endpoint=False).astype(np.int64)
    stretch = np.repeat(np.arange(stretches), np.diff(np.append(starts, len(y))))
    least = np.fmin.reduceat(y, starts)[stretch]
    greatest = np.fmax.reduceat(y, starts)[stretch]
    extreme = np.flatnonzero((y == least) | (y == greatest) | np.isnan(least))
    # of equal ones the first of each stretch, for the least, the greatest and the gap apart
    kind = np.where(y[extreme] == least[extreme], 0, np.where(y[extreme] == greatest[extreme], 1, 2))
    _, first = np.unique(stretch[extreme] * 3 + kind, return_index=True)
    kept = np.sort(extreme[first])
    return x[kept], y[kept]
