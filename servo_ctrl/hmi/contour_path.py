"""The path in the plane: command and table, the error between them magnified, and no peak of it lost."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


def across(command_m: Array, actual_m: Array) -> Array:
    """The part of the error (n, 2) that is normal to the direction of the command, (n, 2).

    Where the command rests its last direction holds; before its first motion the error is there whole.
    `learning.performance.path_deviation` is its length.
    """
    error_m = actual_m - command_m
    step_m = np.diff(command_m, axis=0, prepend=command_m[:1])
    length_m = np.hypot(step_m[:, 0], step_m[:, 1])
    latest = np.maximum.accumulate(np.where(length_m > 0.0, np.arange(len(length_m)), -1))
    known = latest >= 0
    tangent = np.zeros_like(step_m)
    tangent[known] = step_m[latest[known]] / length_m[latest[known], np.newaxis]
    along_m = np.sum(error_m * tangent, axis=1)[:, np.newaxis]
    return np.asarray(error_m - along_m * tangent)


def path_points(rows: Array, bucket: int, lead: int, factor: float) -> bytes:
    """Points for a chart, one of each bucket: the row that is farthest off the path.

    `rows` (n, 4): command x, y, actual x, y; the first bucket lacks `lead` rows. The bytes are float64:
    command x, command y, then x and y of command + `factor` times the normal error.
    """
    command_m, actual_m = rows[:, :2], rows[:, 2:]
    off_m = across(command_m, actual_m)
    size_m = np.nan_to_num(np.hypot(off_m[:, 0], off_m[:, 1]), nan=-1.0)
    begins = np.maximum(np.arange(-lead, len(rows), bucket), 0)
    if not len(rows):
        return b""
    largest = np.repeat(np.maximum.reduceat(size_m, begins), np.diff(begins, append=len(rows)))
    # the first row of each bucket that has its largest
    candidates = np.flatnonzero(size_m == largest)
    chosen = candidates[np.searchsorted(candidates, begins)]
    drawn_m = command_m[chosen] + factor * off_m[chosen]
    return bytes(np.vstack((command_m[chosen].T, drawn_m.T)).tobytes())
