"""The array types of numerical files; docstrings give the shapes."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
"""Array of double-precision floats."""
Index = NDArray[np.int64]
"""Array of indices into another array."""


def compiled_layout(values: ArrayLike) -> Array:
    """Values as kernels take them: for a strided or read-only array numba would compile anew, for seconds."""
    return np.require(values, np.float64, ("C", "W"))
