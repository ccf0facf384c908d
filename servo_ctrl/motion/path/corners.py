"""Smooths corners and curvature jumps by a blend added to the programmed path.

Neither velocity nor acceleration of an axis may jump. Where the tangent of the programmed path P(s) jumps
by D at s = s_i, and its curvature by C, the executed path is

    p(s) = P(s) + sum over i of D_i g(s - s_i; h_i) + C_i q(s - s_i; b_i)

g and q vanish beyond their half widths h and b, and jump by -1 at 0 in their first and second derivative,
so that p has continuous curvature: kinematic corner smoothing (Tajima and Sencer 2016), over the length
instead of the time. For 0 < x = |s - s_i| / h

    g = h (1 - x)^3 / 6                      g'' = (1 - x) / h: a triangle, as of an axis at constant jerk
    q'' = -(1/2 - 7/6 x) up to x = 1/2, then (1 - x) / 6: rises beyond the new curvature by 1/12

so that the adjacent elements keep their place. Blends may overlap: where many short lines approximate a
curve, the triangles add up to its curvature. The blend deviates by at most h |D| / 6 at a corner and by
0.0083 b^2 |C| at a curvature jump.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array
from kernels.jit import kernel
from servo_ctrl.motion.path.programmed_path import Outline, curvature, tangent
from servo_ctrl.motion.profile import MotionLimits

Flags = NDArray[np.bool_]

STRAIGHT_ON_RAD = 1e-6
"""Bounds the angle of a joint that is passed without a stop at any tolerance; chosen."""

LEAST_TOLERANCE_M = 1e-9
"""Tolerance of such joints under exact stop, metres; chosen below any scale's resolution."""

_CURVATURE_SHARE = 0.1  # chosen: share of the tolerance for curvature jumps, which need nanometres
_Q_PEAK = 0.00832  # largest |q| / b^2, at x = 0.2265
_LIMIT_SHARE = 0.8  # chosen: share of the limits that a corner at feed uses; the rest permits acceleration


class Joints(NamedTuple):
    """Joints of elements that meet without a stop; arrays are (m,) and (m, axes)."""

    at_m: Array
    """Path length of the joint."""
    bend: Array
    """Jump of the tangent, D."""
    half_m: Array
    """Half width h of its blend; 0 = none."""
    jump_1_m: Array
    """Jump of the curvature, C."""
    jump_half_m: Array
    """Half width b of its blend."""


def bends(outline: Outline) -> tuple[Array, Array]:
    """Return the jumps of tangent and curvature (n - 1, axes) from each element to the next."""
    before, after = np.arange(len(outline.length_m) - 1), np.arange(1, len(outline.length_m))
    nothing = np.zeros(len(before))
    bend = tangent(outline, after, nothing) - tangent(outline, before, outline.length_m[:-1])
    jump = curvature(outline, after, nothing) - curvature(outline, before, outline.length_m[:-1])
    return bend, jump


def joints(
    outline: Outline,
    feed_m_s: Array,
    stops: Flags,
    tolerance_m: float,
    limits: MotionLimits,
    wider: Array,
) -> Joints:
    """Choose the width of each joint without a stop: as wide as the feed needs, within the tolerance.

    `feed_m_s` (n,): feed of the elements. `stops` (n,): whether the axes stop after each. `wider` (n - 1,):
    factor on the width that a single corner needs.
    """
    ends_m = np.cumsum(outline.length_m)
    bend, jump = bends(outline)
    speed = np.minimum(feed_m_s, along(outline, limits.velocity_m_s))
    passed = np.flatnonzero(~stops[:-1])
    at_m, bend, jump = ends_m[passed], bend[passed], jump[passed]
    speed = np.minimum(speed[passed], speed[passed + 1])[:, np.newaxis]
    # distance to the nearer of the stops before and after
    stop_m = np.concatenate(([0.0], ends_m[stops]))
    behind = np.searchsorted(stop_m, at_m)
    room_m = np.minimum(at_m - stop_m[behind - 1], stop_m[behind] - at_m)
    allowed_m = max(tolerance_m, LEAST_TOLERANCE_M)
    with np.errstate(divide="ignore", over="ignore"):
        needed_m = np.maximum(
            speed**2 * np.abs(bend) / (_LIMIT_SHARE * limits.acceleration_m_s2),
            np.sqrt(speed**3 * np.abs(bend) / (_LIMIT_SHARE * limits.jerk_m_s3)),
        ).max(axis=1)
        cut = np.linalg.norm(bend, axis=1)
        needed_m *= wider[passed]
        half_m = np.minimum(np.minimum(needed_m, room_m), 6.0 * (1.0 - _CURVATURE_SHARE) * allowed_m / cut)
        needed_m = (7.0 / 6.0 * speed**3 * np.abs(jump) / (_LIMIT_SHARE * limits.jerk_m_s3)).max(axis=1)
        # narrower than both neighbours: at most two overlap
        room_m = np.minimum(outline.length_m[passed], outline.length_m[passed + 1])
        size = np.linalg.norm(jump, axis=1)
        tolerated_m = np.sqrt(_CURVATURE_SHARE * allowed_m / (2.0 * _Q_PEAK * size))
        jump_half_m = np.minimum(np.minimum(needed_m, room_m), tolerated_m)
    # smaller jumps are rounding errors: 1e-12 of the speed, 1e-9 of its square per metre
    half_m[cut < 1e-12] = 0.0
    jump_half_m[size < 1e-9] = 0.0
    half_m *= _fitting(at_m, cut, half_m, (1.0 - _CURVATURE_SHARE) * allowed_m)
    return Joints(at_m, bend, half_m, jump, jump_half_m)


def passing_speed(joints_: Joints, limits: MotionLimits) -> Array:
    """Return the speed, m/s, at which each joint (m,) alone could be passed."""
    acceleration, jerk = _LIMIT_SHARE * limits.acceleration_m_s2, _LIMIT_SHARE * limits.jerk_m_s3
    bend, jump = np.abs(joints_.bend), np.abs(joints_.jump_1_m)
    h, b = joints_.half_m[:, np.newaxis], joints_.jump_half_m[:, np.newaxis]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        speeds = (
            np.sqrt(acceleration * h / bend),
            np.cbrt(jerk * h**2 / bend),
            np.cbrt(6.0 / 7.0 * jerk * b / jump),
        )
    # a joint without a blend bends by rounding errors only
    smoothed = (h > 0.0, h > 0.0, b > 0.0)
    return np.asarray(
        np.min([np.where(f, v, np.inf) for f, v in zip(smoothed, speeds, strict=True)], axis=(0, 2))
    )


def along(outline: Outline, limit: Array) -> Array:
    """Return the limit along each element (n,), which the first axis at its own limit determines."""
    share = np.abs(outline.direction)
    rows = np.flatnonzero(outline.radius_m)
    for side in (0, 1):
        share[rows, outline.plane[rows, side]] += (outline.radius_m * np.abs(outline.turn_rad_m))[rows]
    with np.errstate(divide="ignore", over="ignore"):
        return np.asarray((limit / share).min(axis=1))


def breakpoints(joints_: Joints) -> Array:
    """Return the path lengths between which the blend is a cubic."""
    at, h, b = joints_.at_m, joints_.half_m, joints_.jump_half_m
    return np.concatenate((at, at - h, at + h, at - b, at + b, at - 0.5 * b, at + 0.5 * b))


@kernel
def _fitting(at_m: Array, cut: Array, half_m: Array, allowed_m: float) -> Array:
    """Return the factor on each width with which overlapping blends together keep the tolerance.

    Between two corners the sum of g |D| is convex, so its maximum is at a corner. A factor f on a width
    reduces g at least by f everywhere.
    """
    count = len(at_m)
    total = np.zeros(count)
    factor = np.ones(count)
    for final in (False, True):
        for i in range(count):
            for step in (-1, 1):
                j = i if step < 0 else i + 1
                while 0 <= j < count and abs(at_m[j] - at_m[i]) < half_m[i]:
                    if final:
                        factor[i] = min(factor[i], allowed_m / total[j])
                    else:
                        inside = 1.0 - abs(at_m[j] - at_m[i]) / half_m[i]
                        total[j] += cut[i] * half_m[i] * inside**3 / 6.0
                    j += step
    return factor


@kernel
def added(joints_: Joints, start_m: Array, middle_m: Array) -> Array:
    """Return the blend and its first three derivatives at the start of each zone, (zones, 4, axes)."""
    at_m, bend, half_m, jump_1_m, jump_half_m = joints_
    zones, axes = len(start_m), bend.shape[1]
    out = np.zeros((zones, 4, axes))
    for i in range(len(at_m)):
        for first in (True, False):
            width = half_m[i] if first else jump_half_m[i]
            size = bend[i] if first else jump_1_m[i]
            zone = np.searchsorted(middle_m, at_m[i] - width)
            while zone < zones and middle_m[zone] < at_m[i] + width:
                side = 1.0 if middle_m[zone] > at_m[i] else -1.0
                # the middle of the zone selects the cubic, its start the argument
                middle_x = abs(middle_m[zone] - at_m[i]) / width
                x = side * (start_m[zone] - at_m[i]) / width
                if first:
                    y = 1.0 - x
                    d0 = width * y**3 / 6.0
                    d1 = -side * 0.5 * y**2
                    d2 = y / width
                    d3 = -side / width**2
                elif middle_x < 0.5:
                    d0 = side * width**2 * (x / 12.0 - x**2 / 4.0 + 7.0 * x**3 / 36.0)
                    d1 = width * (1.0 / 12.0 - x / 2.0 + 7.0 * x**2 / 12.0)
                    d2 = side * (7.0 * x / 6.0 - 0.5)
                    d3 = 7.0 / 6.0 / width
                else:
                    d0 = side * width**2 * (1.0 - x) ** 3 / 36.0
                    d1 = -width * (1.0 - x) ** 2 / 12.0
                    d2 = side * (1.0 - x) / 6.0
                    d3 = -1.0 / (6.0 * width)
                for axis in range(axes):
                    out[zone, 0, axis] += size[axis] * d0
                    out[zone, 1, axis] += size[axis] * d1
                    out[zone, 2, axis] += size[axis] * d2
                    out[zone, 3, axis] += size[axis] * d3
                zone += 1
    return out
