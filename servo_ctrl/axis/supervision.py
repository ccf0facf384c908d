"""Derives supervision limits from the machine file; `cyclic.supervision` applies them in each cycle."""

import math

from servo_ctrl.canopen.scaling import DriveScaling
from servo_ctrl.config.model import AxisConfig
from servo_ctrl.control.signs import SupervisionLimits

PUSH_SHARE = 0.25
"""Share of the force limit that counts as a push; friction or a process may exceed less; chosen."""
ERROR_SHARE = 0.02
"""Share of the following error limit that counts as growth of the error; less may be noise; chosen."""
LIMIT_SHARE = 0.98
"""Share of the current limit that counts as saturated, because a measured current is rounded and lags;
chosen."""
SPEED_FLOOR_M_S = 2e-3
"""Least difference between two speeds, to which two counts a period are added. Chosen."""


def saturation_cycles(axis: AxisConfig, period_s: float) -> int:
    """Return for how many cycles the current may stay at its limit."""
    return max(math.ceil(axis.limits.saturation_ms * 1e-3 / period_s), 1)


def runaway_cycles(axis: AxisConfig, period_s: float) -> int:
    """Return the cycles of a block of motion, at least 3: two halves and a cycle between them."""
    return max(math.ceil(axis.limits.runaway_ms * 1e-3 / period_s), 3)


def supervision_limits(axis: AxisConfig, scaling: DriveScaling, period_s: float) -> SupervisionLimits:
    """Return the supervision limits of an axis."""
    limits = axis.limits
    following_m = limits.following_error_mm * 1e-3
    deviation_mm = limits.scale_deviation_mm
    return SupervisionLimits(
        deviation_m=0.5 * following_m if deviation_mm is None else deviation_mm * 1e-3,
        force_n=limits.force_n,
        current_a=LIMIT_SHARE * limits.force_n / scaling.newton_per_ampere,
        push_n=PUSH_SHARE * limits.force_n,
        error_m=ERROR_SHARE * following_m,
        velocity_m_s=SPEED_FLOOR_M_S + 2.0 * scaling.metre_per_count / period_s,
        saturation_cycles=saturation_cycles(axis, period_s),
        runaway_cycles=runaway_cycles(axis, period_s),
    )
