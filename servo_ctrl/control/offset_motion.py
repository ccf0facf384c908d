"""A small shift of the motor's set point, which is reached by a motion of its own instead of a jump.

Five-phase S curve without a cruise (Wang et al. 2014, equations 2-4, figure 6b), u = t / tj, tj a quarter of
the duration, for the distance d:

    0 <= u <= 1:  d u^3 / 12          1 <= u <= 2:  d (u - 1) / 2 + d (2 - u)^3 / 12          then mirrored

or a triangle of velocity (trapezoidal profile without a cruise), 2 d (t / T)^2 up to T / 2, then mirrored.
"""

import math
from typing import NamedTuple

from kernels.jit import kernel


class OffsetMotion(NamedTuple):
    """A shift of the motor's set point that moves from one value to another.

    `smooth`: five-phase S curve; else a triangle of velocity.
    """

    from_m: float
    to_m: float
    elapsed_s: float
    duration_s: float
    smooth: bool


@kernel
def resting() -> OffsetMotion:
    """No shift, at rest."""
    return OffsetMotion(from_m=0.0, to_m=0.0, elapsed_s=0.0, duration_s=0.0, smooth=True)


@kernel
def rest_to_rest(
    from_m: float, to_m: float, smooth: bool, acceleration_m_s2: float, jerk_m_s3: float
) -> OffsetMotion:
    """The fastest motion from rest to rest within the acceleration and, if smooth, the jerk (both > 0)."""
    distance_m = abs(to_m - from_m)
    if smooth:
        quarter_s = max(
            (distance_m / (2.0 * jerk_m_s3)) ** (1.0 / 3.0), math.sqrt(distance_m / (2.0 * acceleration_m_s2))
        )
        return OffsetMotion(from_m, to_m, 0.0, 4.0 * quarter_s, smooth)
    return OffsetMotion(from_m, to_m, 0.0, 2.0 * math.sqrt(distance_m / acceleration_m_s2), smooth)


@kernel
def advanced(s: OffsetMotion, period_s: float) -> OffsetMotion:
    """The motion one period later."""
    return OffsetMotion(s.from_m, s.to_m, min(s.elapsed_s + period_s, s.duration_s), s.duration_s, s.smooth)


@kernel
def shifted(s: OffsetMotion, by_m: float) -> OffsetMotion:
    """The same motion, with both ends moved by `by_m`."""
    return OffsetMotion(s.from_m + by_m, s.to_m + by_m, s.elapsed_s, s.duration_s, s.smooth)


@kernel
def over(s: OffsetMotion) -> bool:
    """Whether the motion has reached its end."""
    return bool(s.elapsed_s >= s.duration_s)


@kernel
def offset_m(s: OffsetMotion) -> float:
    """The present shift, m."""
    if s.elapsed_s >= s.duration_s:
        return s.to_m
    share = s.elapsed_s / s.duration_s
    nearer = min(share, 1.0 - share)
    if not s.smooth:
        covered = 2.0 * nearer * nearer
    else:
        u = 4.0 * nearer
        covered = u * u * u / 12.0 if u < 1.0 else 0.5 * (u - 1.0) + (2.0 - u) ** 3 / 12.0
    if share > 0.5:
        covered = 1.0 - covered
    return s.from_m + (s.to_m - s.from_m) * covered
