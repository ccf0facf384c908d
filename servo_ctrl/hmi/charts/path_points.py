"""The path in the plane for a chart: the normal error magnified, decimated without losing a peak of it."""

import numpy as np

from kernels.arrays import Array


def normal_error(command_m: Array, actual_m: Array) -> Array:
    """The part of the error (n, 2) that is normal to the direction of the command (n, 2).

    While the command rests, its last direction counts; before its first motion the whole error is returned.
    """
    error_m = actual_m - command_m
    step_m = np.diff(command_m, axis=0, prepend=command_m[:1])
    length_m = np.hypot(step_m[:, 0], step_m[:, 1])
    last_moving = np.maximum.accumulate(np.where(length_m > 0.0, np.arange(len(length_m)), -1))
    has_moved = last_moving >= 0
    tangent = np.zeros_like(step_m)
    tangent[has_moved] = step_m[last_moving[has_moved]] / length_m[last_moving[has_moved], np.newaxis]
    tangential_m = np.sum(error_m * tangent, axis=1)[:, np.newaxis]
    return np.asarray(error_m - tangential_m * tangent)


def path_points(rows: Array, bucket: int, lead: int, factor: float) -> bytes:
    """One point of each bucket of rows: the row with the largest normal error.

    `rows` (n, 4): command x and y, actual x and y; the first bucket lacks `lead` rows. The bytes are float64:
    command x, command y, then x and y of command + `factor` times the normal error.
    """
    if not len(rows):
        return b""
    command_m, actual_m = rows[:, :2], rows[:, 2:]
    error_m = normal_error(command_m, actual_m)
    size_m = np.nan_to_num(np.hypot(error_m[:, 0], error_m[:, 1]), nan=-1.0)
    begins = np.maximum(np.arange(-lead, len(rows), bucket), 0)
    largest = np.repeat(np.maximum.reduceat(size_m, begins), np.diff(begins, append=len(rows)))
    # where several rows of a bucket have its largest error, the first of them
    candidates = np.flatnonzero(size_m == largest)
    chosen = candidates[np.searchsorted(candidates, begins)]
    drawn_m = command_m[chosen] + factor * error_m[chosen]
    return bytes(np.vstack((command_m[chosen].T, drawn_m.T)).tobytes())
