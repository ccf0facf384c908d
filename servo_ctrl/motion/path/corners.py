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
    tangent_jump: Array
    """Jump of the tangent, D."""
    tangent_half_width_m: Array
    """Half width h of its blend; 0 = none."""
    curvature_jump_1_m: Array
    """Jump of the curvature, C."""
    curvature_half_width_m: Array
    """Half width b of its blend."""


def tangent_and_curvature_jumps(outline: Outline) -> tuple[Array, Array]:
    """Return the jumps of tangent and curvature (n - 1, axes) from each element to the next."""
    before, after = np.arange(len(outline.length_m) - 1), np.arange(1, len(outline.length_m))
    nothing = np.zeros(len(before))
    tangent_jump = tangent(outline, after, nothing) - tangent(outline, before, outline.length_m[:-1])
    curvature_jump = curvature(outline, after, nothing) - curvature(outline, before, outline.length_m[:-1])
    return tangent_jump, curvature_jump


def joints(
    outline: Outline,
    feed_m_s: Array,
    stops: Flags,
    tolerance_m: float,
    limits: MotionLimits,
    width_factor: Array,
) -> Joints:
    """Choose the width of each joint without a stop: as wide as the feed needs, within the tolerance.

    `feed_m_s` (n,): feed of the elements. `stops` (n,): whether the axes stop after each. `width_factor`
    (n - 1,): factor on the width that a single corner needs.
    """
    ends_m = np.cumsum(outline.length_m)
    tangent_jump, curvature_jump = tangent_and_curvature_jumps(outline)
    speed = np.minimum(feed_m_s, limit_along_path(outline, limits.velocity_m_s))
    passed = np.flatnonzero(~stops[:-1])
    at_m, tangent_jump, curvature_jump = ends_m[passed], tangent_jump[passed], curvature_jump[passed]
    speed = np.minimum(speed[passed], speed[passed + 1])[:, np.newaxis]
    # distance to the nearer of the stops before and after
    stop_m = np.concatenate(([0.0], ends_m[stops]))
    behind = np.searchsorted(stop_m, at_m)
    available_m = np.minimum(at_m - stop_m[behind - 1], stop_m[behind] - at_m)
    allowed_m = max(tolerance_m, LEAST_TOLERANCE_M)
    with np.errstate(divide="ignore", over="ignore"):
        needed_m = np.maximum(
            speed**2 * np.abs(tangent_jump) / (_LIMIT_SHARE * limits.acceleration_m_s2),
            np.sqrt(speed**3 * np.abs(tangent_jump) / (_LIMIT_SHARE * limits.jerk_m_s3)),
        ).max(axis=1)
        jump_norm = np.linalg.norm(tangent_jump, axis=1)
        needed_m *= width_factor[passed]
        tangent_half_width_m = np.minimum(
            np.minimum(needed_m, available_m), 6.0 * (1.0 - _CURVATURE_SHARE) * allowed_m / jump_norm
        )
        needed_m = (7.0 / 6.0 * speed**3 * np.abs(curvature_jump) / (_LIMIT_SHARE * limits.jerk_m_s3)).max(
            axis=1
        )
        # narrower than both adjacent elements, so that at most two blends overlap
        available_m = np.minimum(outline.length_m[passed], outline.length_m[passed + 1])
        curvature_norm_1_m = np.linalg.norm(curvature_jump, axis=1)
        tolerated_m = np.sqrt(_CURVATURE_SHARE * allowed_m / (2.0 * _Q_PEAK * curvature_norm_1_m))
        curvature_half_width_m = np.minimum(np.minimum(needed_m, available_m), tolerated_m)
    # smaller jumps are rounding errors
    tangent_half_width_m[jump_norm < 1e-12] = 0.0
    curvature_half_width_m[curvature_norm_1_m < 1e-9] = 0.0
    tangent_half_width_m *= _width_factor_within_tolerance(
        at_m, jump_norm, tangent_half_width_m, (1.0 - _CURVATURE_SHARE) * allowed_m
    )
    return Joints(at_m, tangent_jump, tangent_half_width_m, curvature_jump, curvature_half_width_m)


def passing_speed(joints_: Joints, limits: MotionLimits) -> Array:
    """Return the speed, m/s, at which each joint (m,) alone could be passed."""
    acceleration, jerk = _LIMIT_SHARE * limits.acceleration_m_s2, _LIMIT_SHARE * limits.jerk_m_s3
    tangent_jump, curvature_jump = np.abs(joints_.tangent_jump), np.abs(joints_.curvature_jump_1_m)
    h, b = joints_.tangent_half_width_m[:, np.newaxis], joints_.curvature_half_width_m[:, np.newaxis]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        speeds = (
            np.sqrt(acceleration * h / tangent_jump),
            np.cbrt(jerk * h**2 / tangent_jump),
            np.cbrt(6.0 / 7.0 * jerk * b / curvature_jump),
        )
    # a joint without a blend has jumps of rounding errors only
    smoothed = (h > 0.0, h > 0.0, b > 0.0)
    return np.asarray(
        np.min([np.where(f, v, np.inf) for f, v in zip(smoothed, speeds, strict=True)], axis=(0, 2))
    )


def limit_along_path(outline: Outline, limit: Array) -> Array:
    """Return the limit along each element (n,), which the first axis at its own limit determines."""
    share = np.abs(outline.direction)
    rows = np.flatnonzero(outline.radius_m)
    for side in (0, 1):
        share[rows, outline.plane[rows, side]] += (outline.radius_m * np.abs(outline.turn_rad_m))[rows]
    with np.errstate(divide="ignore", over="ignore"):
        return np.asarray((limit / share).min(axis=1))


def breakpoints(joints_: Joints) -> Array:
    """Return the path lengths between which the blend is a cubic."""
    at, h, b = joints_.at_m, joints_.tangent_half_width_m, joints_.curvature_half_width_m
    return np.concatenate((at, at - h, at + h, at - b, at + b, at - 0.5 * b, at + 0.5 * b))


@kernel
def _width_factor_within_tolerance(
    at_m: Array, jump_norm: Array, tangent_half_width_m: Array, allowed_m: float
) -> Array:
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
                while 0 <= j < count and abs(at_m[j] - at_m[i]) < tangent_half_width_m[i]:
                    if final:
                        factor[i] = min(factor[i], allowed_m / total[j])
                    else:
                        inside = 1.0 - abs(at_m[j] - at_m[i]) / tangent_half_width_m[i]
                        total[j] += jump_norm[i] * tangent_half_width_m[i] * inside**3 / 6.0
                    j += step
    return factor


@kernel
def blend_derivatives(joints_: Joints, start_m: Array, middle_m: Array) -> Array:
    """Return the blend and its first three derivatives at the start of each zone, (zones, 4, axes)."""
    at_m, tangent_jump, tangent_half_width_m, curvature_jump_1_m, curvature_half_width_m = joints_
    zones, axes = len(start_m), tangent_jump.shape[1]
    out = np.zeros((zones, 4, axes))
    for i in range(len(at_m)):
        for first in (True, False):
            width = tangent_half_width_m[i] if first else curvature_half_width_m[i]
            size = tangent_jump[i] if first else curvature_jump_1_m[i]
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
