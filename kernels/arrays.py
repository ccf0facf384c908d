"""The array types of numerical files, and functions of any array; docstrings give the shapes."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
"""Array of double-precision floats."""
Index = NDArray[np.int64]
"""Array of indices into another array."""


def compiled_layout(values: ArrayLike) -> Array:
    """Return a contiguous, writable array: for another layout numba would compile again, for seconds."""
    return np.require(values, np.float64, ("C", "W"))


def rms(values: NDArray[np.float64]) -> float:
    """Return the root mean square of values."""
    return float(np.sqrt(np.mean(values**2)))


def true_runs(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return the first and one past the last index of each run of true values in `mask` (n,)."""
    edges = np.flatnonzero(np.diff(mask.astype(np.int8), prepend=0, append=0))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
