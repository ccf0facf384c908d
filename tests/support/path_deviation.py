"""Deviation from any commanded path: a reference for contour errors, independent of the product."""

import numpy as np

from kernels.arrays import Array


def path_deviation(command_m: Array, actual_m: Array) -> Array:
    """Distance of `actual_m` (n, 2) from any commanded path (n, 2), normal to it, left positive, (n,).

    To first order: the error's part across the direction of the command. Where the command stands still,
    its last direction holds, before the first motion its first. On a path of radius R the order
    that is left out is e^2 / 2R. Without any motion the deviation is the length of the error.
    """
    error_m = actual_m - command_m
    step_m = np.diff(command_m, axis=0, prepend=command_m[:1])
    length_m = np.hypot(step_m[:, 0], step_m[:, 1])
    moving = np.flatnonzero(length_m)
    if not len(moving):
        return np.hypot(error_m[:, 0], error_m[:, 1])
    latest = np.maximum.accumulate(np.where(length_m > 0.0, np.arange(len(length_m)), moving[0]))
    tangent = step_m[latest] / length_m[latest, np.newaxis]
    return tangent[:, 0] * error_m[:, 1] - tangent[:, 1] * error_m[:, 0]
