"""The motion along the path: from stop to stop, each with the smoothing time that makes it fastest."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from servo_ctrl.motion.path_ramps import duration_s, over_time, speed_over_length
from servo_ctrl.motion.path_zones import Bounds, shares

if TYPE_CHECKING:
    from servo_ctrl.motion.path_zones import Zones
    from servo_ctrl.motion.profile import Array, MotionLimits

_TRIES = 8
"""Smoothing times tried where no closed form is at hand, each 0.7 of the one before."""
_REFINEMENTS = 3


class Knots(NamedTuple):
    """The length over time, (k,): a cubic between two knots, with continuous acceleration."""

    time_s: Array
    length_m: Array
    speed_m_s: Array
    acceleration_m_s2: Array


def knots(zones: Zones, bounds: Bounds, stop_m: Array, limits: MotionLimits, period_s: float) -> Knots:
    """From rest to rest over each span between two of the lengths `stop_m`, which are edges of zones."""
    first = np.searchsorted(zones.start_m, stop_m)
    begin_s, parts = 0.0, []
    for low, high in itertools.pairwise(first):
        span = slice(int(low), int(high))
        time_s, *rest = _span(
            zones.start_m[span],
            zones.end_m[span],
            Bounds(*(values[span] for values in bounds)),
            limits,
            period_s,
        )
        parts.append((begin_s + time_s, *rest))
        begin_s += float(time_s[-1])
    return Knots(*(np.concatenate(values) for values in zip(*parts, strict=True)))


def length_at(knots_: Knots, time_s: Array) -> tuple[Array, Array, Array]:
    """Length m, speed m/s and acceleration m/s^2 at the instants (n,)."""
    time, length_m, speed, acceleration = knots_
    k = np.clip(np.searchsorted(time, time_s, side="right") - 1, 0, len(time) - 2)
    dt = np.clip(time_s - time[k], 0.0, time[k + 1] - time[k])
    with np.errstate(invalid="ignore", divide="ignore"):
        # two stops may share an instant
        jerk = np.nan_to_num((acceleration[k + 1] - acceleration[k]) / (time[k + 1] - time[k]))
    return (
        length_m[k] + dt * (speed[k] + dt * (acceleration[k] / 2.0 + dt * jerk / 6.0)),
        speed[k] + dt * (acceleration[k] + dt * jerk / 2.0),
        acceleration[k] + dt * jerk,
    )


def _span(
    start_m: Array, end_m: Array, bounds: Bounds, limits: MotionLimits, period_s: float
) -> tuple[Array, Array, Array, Array]:
    tries = []
    for tau_s in _smoothing_times(bounds, limits, period_s):
        speed, acceleration = shares(bounds, limits, tau_s, bounds.speed_m_s)
        nodes = speed_over_length(start_m, end_m, speed, acceleration, tau_s)
        tries.append((duration_s(*nodes, tau_s), tau_s, nodes))
    best_s, tau_s, best = min(tries, key=lambda tried: tried[:2])
    for _ in range(_REFINEMENTS if len(start_m) > 1 else 0):
        # where a zone's speed is not reached, it may have more acceleration
        highest = np.minimum(bounds.speed_m_s, 1.1 * _reached(start_m, end_m, *best, tau_s))
        speed, acceleration = shares(bounds, limits, tau_s, highest)
        nodes = speed_over_length(start_m, end_m, speed, acceleration, tau_s)
        took_s = duration_s(*nodes, tau_s)
        if took_s > best_s * (1.0 - 1e-3):
            break
        best_s, best = took_s, nodes
    return over_time(*best, tau_s)


def _reached(start_m: Array, end_m: Array, length_m: Array, speed_m_s: Array, tau_s: float) -> Array:
    """The highest speed of v1 in and about each zone."""
    reach_m = tau_s * np.interp(0.5 * (start_m + end_m), length_m, speed_m_s)
    first = np.maximum(np.searchsorted(length_m, start_m - reach_m) - 1, 0)
    last = np.minimum(np.searchsorted(length_m, end_m + reach_m) + 1, len(length_m))
    # `reduceat` takes the spans between neighbouring indices; every second one is asked for
    padded = np.append(speed_m_s, 0.0)
    return np.maximum.reduceat(padded, np.stack((first, last), axis=1).ravel())[::2]


def _smoothing_times(bounds: Bounds, limits: MotionLimits, period_s: float) -> list[float]:
    """Those that may be best; none is shorter than a period, in which set points show no more."""
    share = bounds.derivatives[:, 0]
    with np.errstate(divide="ignore"):
        acceleration = (limits.acceleration_m_s2 / share).min(axis=1)
        jerk = (limits.jerk_m_s3 / share).min(axis=1)
    length_m, top = float(bounds.length_m.sum()), int(np.argmax(bounds.speed_m_s))
    longest_s = float((acceleration / jerk).max())
    times_s = [
        longest_s,
        math.sqrt(bounds.speed_m_s[top] / jerk[top]),
        math.cbrt(0.5 * length_m / jerk[top]),
    ]
    if len(share) > 1:
        times_s += [longest_s * 0.7**k for k in range(1, _TRIES)]
    return sorted({min(max(time_s, period_s), max(longest_s, period_s)) for time_s in times_s})
