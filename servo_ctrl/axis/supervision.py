"""Limits of supervision, from the machine file; `cyclic.supervision` judges by them, cycle by cycle."""

import math

from servo_ctrl.canopen.scaling import DriveScaling
from servo_ctrl.config.model import AxisConfig
from servo_ctrl.control.signs import SupervisionLimits

PUSH_SHARE = 0.25
"""Of the force limit: friction or a process may exceed a smaller push; chosen."""
ERROR_SHARE = 0.02
"""Of the following error limit: a smaller growth of the error may be noise; chosen."""
LIMIT_SHARE = 0.98
"""Share of the limit at which a measured current is at it, as it is rounded, and lags; chosen."""
SPEED_FLOOR_M_S = 2e-3
"""Least difference of two speeds; two counts a period are added to it. Chosen."""


def saturation_cycles(axis: AxisConfig, period_s: float) -> int:
    """Return how long the current may stay at its limit."""
    return max(math.ceil(axis.limits.saturation_ms * 1e-3 / period_s), 1)


def runaway_cycles(axis: AxisConfig, period_s: float) -> int:
    """Return the length of a block of motion; three cycles have two halves and a cycle between them."""
    return max(math.ceil(axis.limits.runaway_ms * 1e-3 / period_s), 3)


def supervision_limits(axis: AxisConfig, unit: DriveScaling, period_s: float) -> SupervisionLimits:
    """Take the limits of an axis from the machine file."""
    limits = axis.limits
    following_m = limits.following_error_mm * 1e-3
    given_mm = limits.scale_deviation_mm
    return SupervisionLimits(
        deviation_m=0.5 * following_m if given_mm is None else given_mm * 1e-3,
        force_n=limits.force_n,
        current_a=LIMIT_SHARE * limits.force_n / unit.newton_per_ampere,
        push_n=PUSH_SHARE * limits.force_n,
        error_m=ERROR_SHARE * following_m,
        velocity_m_s=SPEED_FLOOR_M_S + 2.0 * unit.metre_per_count / period_s,
        saturation_cycles=saturation_cycles(axis, period_s),
        runaway_cycles=runaway_cycles(axis, period_s),
    )
