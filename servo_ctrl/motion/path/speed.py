"""Plans the motion between stops of a path, each span with its fastest smoothing time."""

import itertools
import math
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.motion.path.programmed_path import Indices
from servo_ctrl.motion.path.ramps import duration_s, over_time, speed_over_length
from servo_ctrl.motion.path.zones import Bounds, Zones, speed_and_acceleration
from servo_ctrl.motion.profile import MotionLimits

_SMOOTHING_TIMES = 8
"""Number of smoothing times tried without a closed form, each 0.7 of the previous one; chosen."""
_REFINEMENTS = 3
"""Bounds the iterations that give more acceleration to zones below their speed; chosen."""


class Knots(NamedTuple):
    """Path length over time, (k,): cubics between knots, with continuous acceleration."""

    time_s: Array
    length_m: Array
    speed_m_s: Array
    acceleration_m_s2: Array
    zones: Indices
    """Zones [first, stop) of each knot's span, (k, 2)."""


class Place(NamedTuple):
    """Zone, speed and acceleration at n instants; each (n,)."""

    zone: Indices
    into_m: Array
    """Length into the zone."""
    speed_m_s: Array
    acceleration_m_s2: Array


def knots(zones: Zones, bounds: Bounds, stop_m: Array, limits: MotionLimits, period_s: float) -> Knots:
    """Plan each span from rest to rest between the lengths `stop_m`, which are edges of zones."""
    first = np.searchsorted(zones.start_m, stop_m)
    begin_s, parts = 0.0, []
    for low, high in itertools.pairwise(first.tolist()):
        span = slice(low, high)
        part = _span(
            zones.start_m[span],
            zones.end_m[span],
            Bounds(bounds.derivatives[span], bounds.speed_m_s[span], bounds.length_m[span]),
            limits,
            period_s,
        )
        parts.append((begin_s + part[0], *part[1:]))
        begin_s += float(part[0][-1])
    spans = np.repeat(np.stack((first[:-1], first[1:]), axis=1), [len(part[0]) for part in parts], axis=0)
    time_s, length_m, speed, acceleration = (np.concatenate(values) for values in zip(*parts, strict=True))
    return Knots(time_s, length_m, speed, acceleration, spans)


def place_at(run: Knots, zones: Zones, time_s: Array) -> Place:
    """Return the place at the instants (n,)."""
    k = np.clip(np.searchsorted(run.time_s, time_s, side="right") - 1, 0, len(run.time_s) - 2)
    dt, step_s = time_s - run.time_s[k], run.time_s[k + 1] - run.time_s[k]
    dt = np.clip(dt, 0.0, step_s)
    speed, acceleration = run.speed_m_s[k], run.acceleration_m_s2[k]
    change = run.acceleration_m_s2[k + 1] - acceleration
    # where two spans meet, two knots share an instant
    jerk = np.divide(change, step_s, out=np.zeros_like(step_s), where=step_s > 0.0)
    length_m = run.length_m[k] + dt * (speed + dt * (acceleration / 2.0 + dt * jerk / 6.0))
    # rounding must not carry a length across a stop into the next span
    zone = np.searchsorted(zones.start_m, length_m, side="right") - 1
    zone = np.clip(zone, run.zones[k, 0], run.zones[k, 1] - 1)
    return Place(
        zone,
        length_m - zones.start_m[zone],
        speed + dt * (acceleration + dt * jerk / 2.0),
        acceleration + dt * jerk,
    )


def _span(
    start_m: Array, end_m: Array, bounds: Bounds, limits: MotionLimits, period_s: float
) -> tuple[Array, Array, Array, Array]:
    tries = []
    for tau_s in _smoothing_times(bounds, limits, period_s):
        speed, acceleration = speed_and_acceleration(bounds, limits, tau_s, bounds.speed_m_s)
        nodes = speed_over_length(start_m, end_m, speed, acceleration, tau_s)
        tries.append((duration_s(*nodes, tau_s), tau_s, nodes))
    best_s, tau_s, best = min(tries, key=lambda tried: tried[:2])
    for _ in range(_REFINEMENTS if len(start_m) > 1 else 0):
        # a zone that does not reach its speed may use more acceleration
        highest = np.minimum(bounds.speed_m_s, 1.1 * _reached(start_m, end_m, *best, tau_s))
        speed, acceleration = speed_and_acceleration(bounds, limits, tau_s, highest)
        nodes = speed_over_length(start_m, end_m, speed, acceleration, tau_s)
        candidate_s = duration_s(*nodes, tau_s)
        if candidate_s > best_s * (1.0 - 1e-3):
            break
        best_s, best = candidate_s, nodes
    return over_time(*best, tau_s)


def _reached(start_m: Array, end_m: Array, length_m: Array, speed_m_s: Array, tau_s: float) -> Array:
    """Return the highest speed of v1 in each zone and within tau of it."""
    margin_m = tau_s * np.interp(0.5 * (start_m + end_m), length_m, speed_m_s)
    first = np.maximum(np.searchsorted(length_m, start_m - margin_m) - 1, 0)
    last = np.minimum(np.searchsorted(length_m, end_m + margin_m) + 1, len(length_m))
    # `reduceat` reduces between all neighbouring indices; only every second result is needed
    padded = np.append(speed_m_s, 0.0)
    return np.maximum.reduceat(padded, np.stack((first, last), axis=1).ravel())[::2]


def _smoothing_times(bounds: Bounds, limits: MotionLimits, period_s: float) -> list[float]:
    """Return candidate smoothing times, at least a period, which is the resolution of set points."""
    share = bounds.derivatives[:, 0]
    with np.errstate(divide="ignore", over="ignore"):
        acceleration = (limits.acceleration_m_s2 / share).min(axis=1)
        jerk = (limits.jerk_m_s3 / share).min(axis=1)
    length_m, top = float(bounds.length_m.sum()), int(np.argmax(bounds.speed_m_s))
    longest_s = float((acceleration / jerk).max())
    times_s = [longest_s, math.sqrt(bounds.speed_m_s[top] / jerk[top]), math.cbrt(0.5 * length_m / jerk[top])]
    if len(share) == 1 and not bounds.derivatives[0, 1:].any():
        # a straight move: the speed reached at full acceleration selects the closed form
        full = acceleration[0] * longest_s
        reached = 0.5 * full * (math.sqrt(1.0 + 4.0 * length_m / (full * longest_s)) - 1.0)
        times_s = times_s[:1] if min(bounds.speed_m_s[0], reached) >= full else [min(times_s[1:])]
    else:
        times_s += [longest_s * 0.7**k for k in range(1, _SMOOTHING_TIMES)]
    return sorted({min(max(time_s, period_s), max(longest_s, period_s)) for time_s in times_s})
