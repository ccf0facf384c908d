"""Divides the path into zones, bounds the derivatives of the position in each, and finds the allowed speed.

With speed v, acceleration a and jerk j of the length s(t), an axis at p(s) has

    velocity p' v,   acceleration p'' v^2 + p' a,   jerk p''' v^3 + 3 p'' v a + p' j

so that in a zone with |p'| <= d1, |p''| <= d2, |p'''| <= d3 the limits V, A, J of the axis hold if

    d1 v <= V,   d2 v^2 + d1 |a| <= A,   d3 v^3 + 3 d2 v |a| + d1 |j| <= J.

With |j| <= a / tau (`ramps`) two numbers per zone remain: the highest v, and the |a| that remains at it.
"""

from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from kernels.jit import kernel
from servo_ctrl.motion.path.corners import Joints, blend_derivatives, breakpoints
from servo_ctrl.motion.path.programmed_path import Indices, Outline, curvature, position, tangent
from servo_ctrl.motion.profile import MotionLimits

_ROUNDING = 1e-6  # chosen: share of acceleration and jerk kept free for rounding errors
# chosen: share of the speed at which no acceleration remains, in short and in long zones
_SHORT, _LONG = 0.97, 0.65


class Zones(NamedTuple):
    """n consecutive zones of the path."""

    start_m: Array
    end_m: Array
    element: Indices
    into_m: Array
    """Length into the element at the start of the zone."""
    blend: Array
    """Blend: position and three derivatives (n, 4, axes) at the start of the zone."""


class Bounds(NamedTuple):
    """Bounds in each of n zones."""

    derivatives: Array
    """d1, d2, d3, (n, 3, axes)."""
    speed_m_s: Array
    """Highest speed by feed and velocity limits, (n,)."""
    length_m: Array
    """Length of each zone, (n,)."""


def zones_of(outline: Outline, joints: Joints) -> Zones:
    """Divide the path at the ends of its elements and at the breakpoints of the blends."""
    ends_m = np.cumsum(outline.length_m)
    edge_m = np.unique(np.concatenate(([0.0], ends_m, breakpoints(joints))))
    start_m, end_m = edge_m[:-1], edge_m[1:]
    middle_m = 0.5 * (start_m + end_m)
    element = np.searchsorted(ends_m, middle_m)
    into_m = start_m - (ends_m - outline.length_m)[element]
    return Zones(start_m, end_m, element, into_m, blend_derivatives(joints, start_m, middle_m))


def smoothed_path(outline: Outline, zones: Zones, zone: Indices, x_m: Array) -> tuple[Array, Array, Array]:
    """Return position m, tangent and curvature 1/m, (m, axes), of the smoothed path `x_m` into the zones."""
    e0, e1, e2, e3 = (zones.blend[zone, order] for order in range(4))
    x = x_m[:, np.newaxis]
    of, into_m = zones.element[zone], zones.into_m[zone] + x_m
    return (
        position(outline, of, into_m) + (e0 + x * (e1 + x * (e2 / 2.0 + x * e3 / 6.0))),
        tangent(outline, of, into_m) + (e1 + x * (e2 + x * e3 / 2.0)),
        curvature(outline, of, into_m) + (e2 + x * e3),
    )


def bounds_of(outline: Outline, zones: Zones, feed_m_s: Array, limits: MotionLimits) -> Bounds:
    """Return the bounds in each zone; `feed_m_s` is the feed of the elements.

    On lines the tangent, a quadratic, lies in the hull of its Bezier points: its values at both ends, and its
    linear extrapolation from the start to the middle. The curvature lies between its values at the ends. On
    arcs both may exceed these bounds by terms of the arc's higher derivatives.
    """
    count = len(zones.start_m)
    every, length_m = np.arange(count), zones.end_m - zones.start_m
    of = zones.element
    x = length_m[:, np.newaxis]
    _, t0, k0 = smoothed_path(outline, zones, every, np.zeros(count))
    _, t1, k1 = smoothed_path(outline, zones, every, length_m)
    e1, e2, e3 = (zones.blend[:, order] for order in (1, 2, 3))
    hull = np.stack((t0, t0 + 0.5 * x * k0, t1))
    added_hull = np.stack((e1, e1 + 0.5 * x * e2, e1 + x * (e2 + 0.5 * x * e3)))
    added_2 = np.maximum(np.abs(e2), np.abs(e2 + x * e3))
    # the derivatives of an arc in its plane are at most R w, R w^2, ...
    in_plane = np.zeros((count, outline.base_m.shape[1]))
    rows = np.flatnonzero(outline.radius_m[of])
    for side in (0, 1):
        in_plane[rows, outline.plane[of[rows], side]] = outline.radius_m[of[rows]]
    arc = [in_plane * np.abs(outline.turn_rad_m[of, np.newaxis]) ** order for order in range(5)]
    beyond = arc[4] * x**3 / 40.0  # error of the Hermite quadratic: 4/27 x^3 / 6
    d1 = np.minimum(
        np.abs(hull).max(axis=0) + beyond,
        np.abs(outline.direction[of]) + arc[1] + np.abs(added_hull).max(axis=0),
    )
    d2 = np.minimum(np.maximum(np.abs(k0), np.abs(k1)) + arc[4] * x**2 / 8.0, arc[2] + added_2)
    d3 = np.abs(e3) + arc[3]
    # blends of different widths may make |p'| slightly larger than 1
    stretch = np.minimum(
        np.linalg.norm(hull, axis=2).max(axis=0) + np.linalg.norm(beyond, axis=1),
        1.0 + np.linalg.norm(added_hull, axis=2).max(axis=0),
    )
    with np.errstate(divide="ignore", over="ignore"):
        speed = np.minimum(feed_m_s[of] / np.maximum(stretch, 1.0), (limits.velocity_m_s / d1).min(axis=1))
    return Bounds(np.stack((d1, d2, d3), axis=1), speed, length_m)


@kernel
def _remaining_acceleration(d: Array, acceleration: Array, jerk: Array, tau_s: float, speed: float) -> float:
    """Return the acceleration along the path that remains at a speed in a zone."""
    least = np.inf
    for axis in range(d.shape[1]):
        of_acceleration = (acceleration[axis] - d[1, axis] * speed**2) / d[0, axis]
        of_jerk = (jerk[axis] - d[2, axis] * speed**3) / (3.0 * d[1, axis] * speed + d[0, axis] / tau_s)
        least = min(least, of_acceleration, of_jerk)
    return least


@kernel
def speed_and_acceleration(
    bounds: Bounds, limits: MotionLimits, tau_s: float, speed_m_s: Array
) -> tuple[Array, Array]:
    """Return the highest speed, at most `speed_m_s`, and its remaining acceleration; both (n,), positive.

    The speed stays below the speed without remaining acceleration: closely in a short zone, which shall be
    passed fast, with more margin in a long zone, where the axes must also accelerate.
    """
    acceleration = limits.acceleration_m_s2 * (1.0 - _ROUNDING)
    jerk = limits.jerk_m_s3 * (1.0 - _ROUNDING)
    speeds, remaining = speed_m_s.copy(), np.empty(len(speed_m_s))
    for zone in range(len(speeds)):
        d = bounds.derivatives[zone]
        low, high = 0.0, speed_m_s[zone] / _LONG
        if _remaining_acceleration(d, acceleration, jerk, tau_s, high) <= 0.0:
            for _ in range(40):
                middle = 0.5 * (low + high)
                if _remaining_acceleration(d, acceleration, jerk, tau_s, middle) <= 0.0:
                    high = middle
                else:
                    low = middle
            ramps = (bounds.length_m[zone] / (3.0 * tau_s * low)) ** 2
            share = _SHORT - (_SHORT - _LONG) * ramps / (ramps + 1.0)
            speeds[zone] = min(speeds[zone], share * low)
        remaining[zone] = _remaining_acceleration(d, acceleration, jerk, tau_s, speeds[zone])
    return speeds, remaining
