"""The array type of the generator, which imports nothing of what it tests."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
