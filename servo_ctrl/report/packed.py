"""Arrays in the form of plotly.js, for the reports of servo_ctrl and of reconcile."""

import base64

import numpy as np
from numpy.typing import NDArray


def packed(values: NDArray[np.float64]) -> dict[str, str]:
    """A typed array, base64: four bytes a value instead of the digits of a number."""
    return {"dtype": "f4", "bdata": base64.b64encode(values.astype("<f4").tobytes()).decode("ascii")}
