"""The array types that nearly every numerical file names; a docstring says the shape."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Floats of double precision; a docstring says the shape, as in `(samples, axes)`."""
Index = NDArray[np.int64]
"""Places in another array."""
