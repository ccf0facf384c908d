"""Types that all kinds of motion share: set points as functions of time."""

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


class ProgramBlock(NamedTuple):
    """The present block of a part program."""

    line: int
    rapid: bool
    """Whether the block moves as fast as the axes allow (G0)."""


class Profile(NamedTuple):
    """One planned motion."""

    duration_s: float
    end_m: Array
    """Position of all axes at the end, (axes,)."""
    at: Callable[[Array], Motion]
    """Computes the set points at instants 0 <= t <= `duration_s` analytically."""
    steady_s: tuple[float, float] = (0.0, 0.0)
    """Span at constant speed (circle, sine), where indicators are meaningful; (0, 0) = none."""
    block_at: "Callable[[float], ProgramBlock] | None" = None
    """Returns the block of a part program at an instant; None for other motions."""


class MotionLimits(NamedTuple):
    """Limits of the set points; each array is (axes,), SI units."""

    position_min_m: Array
    position_max_m: Array
    velocity_m_s: Array
    acceleration_m_s2: Array
    jerk_m_s3: Array
    force_n: Array


def resting(start_m: Array, count: int) -> Motion:
    """Return set points of `count` instants at rest at `start_m` (axes,)."""
    shape = (count, len(start_m))
    position_m = np.broadcast_to(start_m, shape).copy()
    return Motion(position_m, np.zeros(shape), np.zeros(shape), np.zeros(shape))


def standstill(position_m: Array, duration_s: float = 0.0) -> Profile:
    """Return a profile that keeps all axes at `position_m` (axes,)."""
    return Profile(duration_s, position_m, lambda time_s: resting(position_m, len(time_s)))
