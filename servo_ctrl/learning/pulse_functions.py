"""Learned functions of the reverse acceleration, and the table that the control law reads.

The paper's learner: T*(a) is linear between its points (Feng et al. 2015, equation 17), A*(a) is a GRNN. The
fast learner has fewer points: both are linear on logarithmic axes. The second trapezoid is interpolated over
log a. Where its amplitude changes sign its purpose changes, so each side is extrapolated to the middle.
Outside the learned range the value at the nearest end applies.
"""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from kernels.arrays import Array
from servo_ctrl.learning.grnn import regression
from servo_ctrl.learning.types import Learned, Pulse

Trailing = tuple[float, float, float, float]

SAMPLES = 240
"""Rows of the table from the lowest to the highest learned acceleration, in equal ratios; chosen."""
SWITCH_RATIO = 1.0 + 1e-9
"""Ratio of the two accelerations between which the second trapezoid switches from one side to the other."""


def durations_s(learned: Learned, at: Array) -> Array:
    """T*(a), seconds, at reverse accelerations (n,)."""
    a, duration = np.array(learned.durations).T
    if learned.spread_m_s2 > 0.0:
        return np.asarray(np.interp(at, a, duration))
    return _interpolate_powers(at, a, duration)


def amplitudes_m_s(learned: Learned, at: Array) -> Array:
    """A*(a), m/s, at reverse accelerations (n,)."""
    a, amplitude = np.array(learned.amplitudes).T
    if learned.spread_m_s2 > 0.0:
        return regression(a, amplitude, learned.spread_m_s2, np.clip(at, a[0], a[-1]))
    return _interpolate_powers(at, a, amplitude)


def table(learned: Learned) -> Array:
    """(6, n): reverse accelerations m/s^2, rising, then the fields of `Pulse` there."""
    trailing = interpolation_points(learned.trailing)
    points = [point[0] for part in (learned.durations, learned.amplitudes, trailing) for point in part]
    at = np.union1d(points, np.geomspace(min(points), max(points), SAMPLES))
    rows = np.zeros((6, len(at)))
    rows[0], rows[1], rows[2] = at, durations_s(learned, at), amplitudes_m_s(learned, at)
    if trailing:
        a, *columns = np.array(trailing).T
        rows[3:] = [np.interp(np.log(at), np.log(a), column) for column in columns]
    return rows


def interpolation_points(points: Sequence[Trailing]) -> list[Trailing]:
    """Prepare the points of the second trapezoid for linear interpolation.

    A point of amplitude 0 gets the times of its nearest neighbour, so that only the amplitude fades. Between
    amplitudes of opposite sign both sides are extrapolated to the middle.
    """
    nonzero = [point for point in points if point[3] != 0.0]
    with_times = []
    for point in points:
        if point[3] == 0.0 and nonzero:
            _, start_s, duration_s, _ = scaled_to(
                min(nonzero, key=lambda right: _log_distance(right, point)), point[0]
            )
            with_times.append((point[0], start_s, duration_s, 0.0))
        else:
            with_times.append(point)
    joined = with_times[:1]
    for left, right in pairwise(with_times):
        if left[3] * right[3] < 0.0:
            middle = (left[0] * right[0]) ** 0.5
            joined += [scaled_to(left, middle), scaled_to(right, middle * SWITCH_RATIO)]
        joined.append(right)
    return joined


def scaled_to(point: Trailing, a: float) -> Trailing:
    """Second trapezoid scaled to acceleration `a`: the same distance is covered in a time ~ 1 / sqrt(a)."""
    stretch = (point[0] / a) ** 0.5
    return a, point[1] * stretch, point[2] * stretch, point[3] / stretch


def _log_distance(left: Trailing, right: Trailing) -> float:
    return abs(math.log(left[0] / right[0]))


def _interpolate_powers(at: Array, a: Array, values: Array) -> Array:
    """Interpolate by powers of a between two points; `values` > 0."""
    return np.asarray(np.exp(np.interp(np.log(at), np.log(a), np.log(values))))


def constant_table(pulse: Pulse) -> Array:
    """Table (6, 1) that gives the same pulse at every reversal."""
    return np.array([[0.0], *([value] for value in pulse)])


def pulse_at(learned: Learned, acceleration_m_s2: float) -> Pulse:
    """Pulse for one reverse acceleration."""
    rows = table(learned)
    return Pulse(*(float(np.interp(acceleration_m_s2, rows[0], row)) for row in rows[1:]))
