"""The array type that nearly every numerical file names."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Floats of double precision; a docstring says the shape, as in `(samples, axes)`."""
