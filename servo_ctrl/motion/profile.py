"""Values of every kind of motion: set points as a function of time, from one position to another."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array


class Motion(NamedTuple):
    """Set points of all axes at n instants; each array is (n, axes), SI units, at the table."""

    position_m: Array
    velocity_m_s: Array
    acceleration_m_s2: Array
    force_offset_n: Array


class Profile(NamedTuple):
    """One motion, planned.

    `at` takes instants 0 <= t <= `duration_s` and gives the analytic set points; nothing is stored.
    `steady_s` is the span in which the motion runs at its constant speed (circle, sine), where
    indicators mean something; (0, 0) where there is none.
    """

    duration_s: float
    end_m: Array
    """Position of all axes at the end, (axes,)."""
    steady_s: tuple[float, float]
    at: Callable[[Array], Motion]


class MotionLimits(NamedTuple):
    """What set points may not exceed; each array is (axes,), SI units."""

    position_min_m: Array
    position_max_m: Array
    velocity_m_s: Array
    acceleration_m_s2: Array
    jerk_m_s3: Array
    force_n: Array


def resting(start_m: Array, count: int) -> Motion:
    """Set points of `count` instants at rest at `start_m` (axes,)."""
    shape = (count, len(start_m))
    position_m = np.broadcast_to(start_m, shape).copy()
    return Motion(position_m, np.zeros(shape), np.zeros(shape), np.zeros(shape))


def along_line(start_m: Array, end_m: Array, path: tuple[Array, Array, Array], distance_m: float) -> Motion:
    """A straight move: path length, speed and acceleration (n,) shared out over the axes.

    Where the path is complete the position is `end_m` to the last bit.
    """
    length_m, speed_m_s, acceleration_m_s2 = path
    direction = (end_m - start_m) / distance_m
    position_m = start_m + np.outer(length_m, direction)
    position_m[length_m >= distance_m] = end_m
    return Motion(
        position_m,
        np.outer(speed_m_s, direction),
        np.outer(acceleration_m_s2, direction),
        np.zeros_like(position_m),
    )
