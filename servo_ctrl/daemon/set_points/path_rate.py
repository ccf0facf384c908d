"""The rate at which a path is passed: what it makes of the programmed motion, and how fast it may change.

Rows are of `reference.Row`; limits are of each axis, m/s^2.
"""

from collections.abc import Sequence

from servo_ctrl.axis.servo import REFERENCE_FIELDS
from servo_ctrl.daemon.set_points.reference import Row

ACCELERATION_SHARE = 0.9
"""Used share of the acceleration limits; the remainder allows for changes within a period. Chosen."""


def steepest_slope_1_s(
    programmed: Row, rate: float, target: float, limits_m_s2: Sequence[float], period_s: float
) -> float:
    """Return the steepest dr/dt towards `target` that keeps |x'' r^2 + x' dr/dt| within every limit."""
    towards = 1.0 if target > rate else -1.0
    steepest = abs(target - rate) / period_s
    axes = zip(programmed[1::REFERENCE_FIELDS], programmed[2::REFERENCE_FIELDS], limits_m_s2, strict=True)
    for speed_m_s, acceleration_m_s2, limit_m_s2 in axes:
        present_m_s2 = acceleration_m_s2 * rate**2
        available_m_s2 = max(ACCELERATION_SHARE * limit_m_s2, abs(present_m_s2))
        if speed_m_s * towards > 0.0:
            steepest = min(steepest, (available_m_s2 - present_m_s2) / abs(speed_m_s))
        elif speed_m_s:
            steepest = min(steepest, (available_m_s2 + present_m_s2) / abs(speed_m_s))
    return towards * steepest


def within_limits(following: Row, row: Row, limits_m_s2: Sequence[float], period_s: float) -> bool:
    """Whether the acceleration of the row `following`, and its velocity change, respect the limits."""
    for axis, limit_m_s2 in enumerate(limits_m_s2):
        first = REFERENCE_FIELDS * axis
        change_m_s2 = (following[first + 1] - row[first + 1]) / period_s
        if max(abs(following[first + 2]), abs(change_m_s2)) > limit_m_s2:
            return False
    return True


def at_rate(programmed: Row, rate: float, slope_1_s: float) -> Row:
    """Scale the programmed motion to a rate that changes by `slope_1_s` per second."""
    row: Row = []
    for first in range(0, len(programmed), REFERENCE_FIELDS):
        position_m, velocity_m_s, acceleration_m_s2, force_n = programmed[first : first + REFERENCE_FIELDS]
        row += [
            position_m,
            velocity_m_s * rate,
            acceleration_m_s2 * rate**2 + velocity_m_s * slope_1_s,
            force_n,
        ]
    return row


def standing(row: Row) -> Row:
    """Copy a row with zero velocity and acceleration."""
    rest = row.copy()
    rest[1::REFERENCE_FIELDS] = rest[2::REFERENCE_FIELDS] = [0.0] * (len(row) // REFERENCE_FIELDS)
    return rest
