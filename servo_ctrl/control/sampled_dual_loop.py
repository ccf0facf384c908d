"""Sampled dual loop: the scale is read at the end point, and the deviation commanded afterwards.

    dL = x* - x_scale, once the command has rested;   x_motor = x* + sum dL

Source: Wang et al. 2014, section 2.

Repeated until |dL| is within the tolerance, or as often as set. Independent of how large the play is, and
never an oscillation: the scale closes no loop while anything moves. What was corrected stays in force, so
the next end point begins with the error of this one; switched off, it is led out by a motion like the others.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from servo_ctrl.control.compensation.trapezoidal_pulse import REST_M
from servo_ctrl.control.jit import kernel
from servo_ctrl.control.limits import clamp
from servo_ctrl.control.offset_motion import advanced, begun, over
from servo_ctrl.control.types import SampledState

if TYPE_CHECKING:
    from servo_ctrl.control.params import SampledDualLoop


@kernel
def advance_sampled(
    p: SampledDualLoop, state: SampledState, deviation_m: float, moving: bool, period_s: float
) -> SampledState:
    """The correction one period later; `deviation_m` is x* - x_scale, NaN without a reading.

    A sample that is absent leaves the axis waiting for the next one.
    """
    motion = advanced(state.motion, period_s)
    if not p.enabled and over(motion) and motion.to_m != 0.0:
        motion = begun(motion.to_m, 0.0, p.smooth, p.acceleration_m_s2, p.jerk_m_s3)
    if not p.enabled or moving:
        return SampledState(0.0, 0, motion)
    if not over(motion):
        return SampledState(0.0, state.corrections, motion)
    rest_s = state.rest_s + period_s
    if rest_s < p.settle_s or state.corrections >= p.corrections or not math.isfinite(deviation_m):
        return SampledState(rest_s, state.corrections, motion)
    if abs(deviation_m) <= p.tolerance_m + REST_M:  # rounding must not look like a deviation
        return SampledState(rest_s, p.corrections, motion)
    wanted_m = clamp(motion.to_m + deviation_m, p.limit_m)
    motion = begun(motion.to_m, wanted_m, p.smooth, p.acceleration_m_s2, p.jerk_m_s3)
    return SampledState(0.0, state.corrections + 1, motion)
