"""The array types of numerical files; docstrings give the shapes."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Array of double-precision floats."""
Index = NDArray[np.int64]
"""Array of indices into another array."""
