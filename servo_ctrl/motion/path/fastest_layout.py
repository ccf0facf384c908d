"""Chooses the widths of the corners, and stops at a corner where a stop is faster than passing it."""

import numpy as np

from kernels.arrays import Array
from servo_ctrl.motion.path.corners import Flags, Joints, joints, limit_along_path, passing_speed
from servo_ctrl.motion.path.programmed_path import Outline
from servo_ctrl.motion.path.ramps import duration_s, speed_over_length
from servo_ctrl.motion.path.speed import Knots, knots
from servo_ctrl.motion.path.zones import Bounds, Zones, bounds_of, speed_and_acceleration, zones_of
from servo_ctrl.motion.profile import MotionLimits

# these four are chosen
_MAX_WIDENINGS = 5  # bounds the iterations of `_widened_layout`
_WIDENING_FACTOR = 1.7  # of the width of a slow corner, each iteration
_SLOW_SHARE = 0.9  # share of the feed below which the corners around a zone are widened
_KEPT_TIME_RATIO = 0.99  # a widening is kept if it reduces the time below this share


def fastest(
    outline: Outline, feed_m_s: Array, stops: Flags, tolerance_m: float, limits: MotionLimits, period_s: float
) -> tuple[Zones, Knots]:
    """Find the fastest motion along the path.

    With a small tolerance a sharp corner must be passed so slowly that a stop takes less time. The axes stop
    there if that makes the whole path faster.
    """
    joints_, zones, bounds = _widened_layout(outline, feed_m_s, stops, tolerance_m, limits)
    run = knots(zones, bounds, _stop_m(outline, stops), limits, period_s)
    more_stops = stops.copy()
    more_stops[np.flatnonzero(~stops[:-1])] = _stop_is_faster(outline, feed_m_s, stops, joints_, limits)
    if (more_stops == stops).all():
        return zones, run
    _, other_zones, bounds = _widened_layout(outline, feed_m_s, more_stops, tolerance_m, limits)
    other_knots = knots(other_zones, bounds, _stop_m(outline, more_stops), limits, period_s)
    return (other_zones, other_knots) if other_knots.time_s[-1] < run.time_s[-1] else (zones, run)


def _stop_m(outline: Outline, stops: Flags) -> Array:
    return np.concatenate(([0.0], np.cumsum(outline.length_m)[stops]))


def _widened_layout(
    outline: Outline, feed_m_s: Array, stops: Flags, tolerance_m: float, limits: MotionLimits
) -> tuple[Joints, Zones, Bounds]:
    """Choose joints, zones and bounds; widen corners that slow the path: overlapping ones need more width."""

    def layout() -> tuple[Joints, Zones, Bounds]:
        joints_ = joints(outline, feed_m_s, stops, tolerance_m, limits, width_factor=width_factor)
        zones = zones_of(outline, joints_)
        return joints_, zones, bounds_of(outline, zones, feed_m_s, limits)

    tau_s = float((limits.acceleration_m_s2 / limits.jerk_m_s3).max())
    width_factor = np.ones(max(len(stops) - 1, 0))
    passed = np.flatnonzero(~stops[:-1])
    joints_, zones, bounds = best = layout()
    current_s = np.inf
    for _ in range(_MAX_WIDENINGS):
        speed, acceleration = speed_and_acceleration(bounds, limits, tau_s, bounds.speed_m_s)
        nodes = speed_over_length(zones.start_m, zones.end_m, speed, acceleration, tau_s)
        previous_s, current_s = current_s, duration_s(*nodes, tau_s)
        if current_s > _KEPT_TIME_RATIO * previous_s:
            break
        best = joints_, zones, bounds
        first = np.searchsorted(zones.start_m, joints_.at_m - joints_.tangent_half_width_m)
        last = np.searchsorted(zones.start_m, joints_.at_m + joints_.tangent_half_width_m)
        speed_share = np.append(speed / bounds.speed_m_s, np.inf)
        slow = np.minimum.reduceat(speed_share, np.stack((first, last), axis=1).ravel())[::2] < _SLOW_SHARE
        if not slow.any():
            break
        width_factor[passed[slow]] *= _WIDENING_FACTOR
        joints_, zones, bounds = layout()
    return best


def _stop_is_faster(
    outline: Outline, feed_m_s: Array, stops: Flags, joints_: Joints, limits: MotionLimits
) -> Flags:
    """Estimate for each joint whether a stop takes less time than passing it.

    With ramps of a = A and tau = A / J from the speed F to v and back, and x = v / F, a corner of the width
    2 h costs (1 - x) ((1 - x) F / a + tau + 2 h / v), a stop F / a + tau. F is the speed that the shorter
    adjacent element permits.
    """
    passed = np.flatnonzero(~stops[:-1])
    acceleration = limit_along_path(outline, limits.acceleration_m_s2)
    tau_s = acceleration / limit_along_path(outline, limits.jerk_m_s3)
    root = 0.5 * (np.sqrt((acceleration * tau_s) ** 2 + 4.0 * acceleration * outline.length_m))
    reached = np.minimum(
        np.minimum(feed_m_s, limit_along_path(outline, limits.velocity_m_s)),
        root - 0.5 * acceleration * tau_s,
    )
    full = np.minimum(reached[passed], reached[passed + 1])
    ramp_s = full / np.minimum(acceleration[passed], acceleration[passed + 1])
    tau_s = np.maximum(tau_s[passed], tau_s[passed + 1])
    speed = np.minimum(passing_speed(joints_, limits), full)
    speed_drop = 1.0 - speed / full
    passing_s = speed_drop * (speed_drop * ramp_s + tau_s + 2.0 * joints_.tangent_half_width_m / speed)
    return np.asarray(passing_s > ramp_s + tau_s)
