"""Plans straight moves from rest to rest, S curve or trapezoid, within the limits of every axis; dwells."""

import math
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.motion.profile import Motion, MotionLimits, Profile, standstill
from servo_ctrl.motion.s_curve import SCurve, s_curve
from servo_ctrl.motion.trapezoidal import Trapezoid, trapezoid


class Move(NamedTuple):
    """A straight move. Axes whose target is NaN hold their position."""

    label: str
    to_m: tuple[float, ...]
    """Absolute target of every axis; NaN = the axis holds its position."""
    feed_m_s: float
    """Speed along the path."""
    acceleration_m_s2: float
    """Acceleration along the path; infinite = as high as the axes allow."""
    trapezoidal: bool


class Dwell(NamedTuple):
    """All axes rest for `duration_s` (> 0)."""

    label: str
    duration_s: float


def plan_move(move: Move, start_m: Array, limits: MotionLimits, period_s: float) -> Profile:
    """Plan the move from `start_m` (axes,).

    Acceleration and jerk follow from the axes' limits and the direction. A trapezoid changes its
    acceleration by up to twice its height within one `period_s`, so the jerk limit bounds it too.
    The feed is not reduced: the check of the program refuses a feed beyond an axis's limit.
    """
    target_m = np.asarray(move.to_m, dtype=np.float64)
    end_m = np.where(np.isnan(target_m), start_m, target_m)
    distance_m = float(np.linalg.norm(end_m - start_m))
    if distance_m == 0.0:
        return standstill(end_m)
    jerk_m_s3 = _along(limits.jerk_m_s3, end_m - start_m)
    acceleration_m_s2 = min(_along(limits.acceleration_m_s2, end_m - start_m), move.acceleration_m_s2)
    if not move.trapezoidal:
        return along_line(start_m, end_m, s_curve(distance_m, move.feed_m_s, acceleration_m_s2, jerk_m_s3))
    if math.isinf(move.acceleration_m_s2):
        acceleration_m_s2 = min(acceleration_m_s2, 0.5 * jerk_m_s3 * period_s)
    return along_line(start_m, end_m, trapezoid(distance_m, move.feed_m_s, acceleration_m_s2))


def along_line(start_m: Array, end_m: Array, curve: SCurve | Trapezoid) -> Profile:
    """Return the straight move; at its end the position is exactly `end_m`."""
    direction = (end_m - start_m) / curve.distance_m

    def at(time_s: Array) -> Motion:
        length_m, speed_m_s, acceleration_m_s2 = curve.travelled(time_s)
        position_m = start_m + np.outer(length_m, direction)
        position_m[length_m >= curve.distance_m] = end_m
        velocity_m_s, acceleration = np.outer(speed_m_s, direction), np.outer(acceleration_m_s2, direction)
        return Motion(position_m, velocity_m_s, acceleration, np.zeros_like(position_m))

    return Profile(curve.duration_s, end_m, at)


def _along(limit: Array, displacement_m: Array) -> float:
    """Return the limit along the path that keeps every axis within its own; infinite without displacement."""
    # no division by a displacement, which may be denormal
    share = float(np.max(np.abs(displacement_m) / limit))
    return math.hypot(*displacement_m) / share if share > 0.0 else math.inf
