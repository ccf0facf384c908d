"""Backlash take-up: the motor goes ahead of the table by half the lost motion, in the direction of motion.

    x_motor = x* + d b / 2,   d the direction of the last motion of the command, b the lost motion

After a reversal the motor has b to take up; it does so by a five-phase S curve of its own. A reversal that
comes while one is under way waits for its end: the set point knows no jump of velocity.
Source: ISO 230-2, reversal value B; Wang et al. 2014, section 1.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from servo_ctrl.control.jit import kernel
from servo_ctrl.control.offset_motion import advanced, begun, over

if TYPE_CHECKING:
    from servo_ctrl.control.params import BacklashTakeUp
    from servo_ctrl.control.types import OffsetMotion


@kernel
def advance_take_up(
    p: BacklashTakeUp, state: OffsetMotion, direction: float, period_s: float
) -> OffsetMotion:
    """The take-up one period later; `direction` of the last motion, +1 or -1, 0 before the first."""
    wanted_m = 0.5 * p.lost_motion_m * direction if p.enabled else 0.0
    if over(state) and wanted_m != state.to_m:
        state = begun(state.to_m, wanted_m, True, p.acceleration_m_s2, p.jerk_m_s3)
    return advanced(state, period_s)
