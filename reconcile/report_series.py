"""Long series made short for a picture, with every peak in them, and arrays as plotly.js takes them."""

from __future__ import annotations

import base64
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


def packed(values: Array) -> dict[str, str]:
    """A typed array of plotly.js: four bytes a value instead of a number's digits."""
    return {"dtype": "f4", "bdata": base64.b64encode(values.astype("<f4").tobytes()).decode("ascii")}


def extremes(x: Array, y: Array, buckets: int) -> tuple[Array, Array]:
    """The lowest and the highest sample of each of so many stretches, in their order; NaN is a gap."""
    n = len(y)
    if n <= 2 * buckets:
        return x, y
    length = -(-n // buckets)
    filled = np.concatenate((y, np.full(-n % length, np.nan)))
    rows = filled.reshape(-1, length)
    gap = np.isnan(rows)
    first = np.arange(len(rows)) * length
    lowest = first + np.where(gap, np.inf, rows).argmin(axis=1)
    highest = first + np.where(gap, -np.inf, rows).argmax(axis=1)
    index = np.unique(np.concatenate((lowest, highest)))
    return x[index], y[index]


def peaks(x: Array, y: Array, buckets: int) -> tuple[Array, Array]:
    """The highest sample of each of so many stretches, even in the logarithm of x; x rises, above 0."""
    if len(y) <= buckets:
        return x, y
    place = np.log(x / x[0]) * (buckets / np.log(x[-1] / x[0]))
    starts = np.flatnonzero(np.diff(np.floor(place), prepend=-1.0) > 0.0)
    top = np.maximum.reduceat(y, starts)
    stretch = np.cumsum(np.isin(np.arange(len(y)), starts)) - 1
    at = np.flatnonzero(y == top[stretch])
    _, firsts = np.unique(stretch[at], return_index=True)
    return x[at[firsts]], y[at[firsts]]
