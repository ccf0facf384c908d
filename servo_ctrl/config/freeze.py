"""From the machine file (mm, ms) to the values that the kernels take (SI, plain floats and ints)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from servo_ctrl.control.types import (
    AxisLimits,
    AxisParams,
    Feedforward,
    Output,
    PositionLoop,
    VelocityLoop,
)
from servo_ctrl.motion.profile import MotionLimits

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from servo_ctrl.config.model import MachineConfig

MM = 1e-3
"""Metres in a millimetre."""
MM_MIN = 1e-3 / 60.0
"""Metres per second in a millimetre per minute."""
_OUTPUT_OF_MODE = {"cst": Output.FORCE, "csv": Output.VELOCITY, "csp": Output.POSITION}


def axis_params(machine: MachineConfig, axis: str) -> AxisParams:
    """What `axis_tick` is given for one axis.

    Every value is made a plain float, int or bool here: numba compiles `axis_tick` anew for each
    combination of types, and the daemon and the batch twin are to share one.
    """
    config = machine.axes[axis]
    control, limits = config.control, config.limits
    period_s = float(machine.period_s)
    return AxisParams(
        period_s=period_s,
        output=int(_OUTPUT_OF_MODE[config.mode]),
        position_loop=PositionLoop(
            kp_1_s=float(control.kp_1_s),
            scale_feedback=control.feedback == "scale",
        ),
        velocity_loop=VelocityLoop(
            kv_n_s_m=float(control.kv_n_s_m),
            ki_n_m=float(control.ki_n_m),
            window_samples=int(control.velocity_window_samples),
            filter_blend=filter_blend(float(control.velocity_filter_ms) * 1e-3, period_s),
        ),
        feedforward=Feedforward(
            velocity=float(control.velocity_feedforward),
            acceleration_kg=float(control.acceleration_feedforward_kg),
        ),
        limits=AxisLimits(
            velocity_m_s=float(limits.velocity_mm_s) * MM,
            force_n=float(limits.force_n),
            following_error_m=float(limits.following_error_mm) * MM,
        ),
    )


def filter_blend(time_constant_s: float, period_s: float) -> float:
    """Share of the new value in a low pass that matches 1 / (1 + s tau) at the samples; 1 for tau = 0."""
    return 1.0 if time_constant_s == 0.0 else -math.expm1(-period_s / time_constant_s)


def motion_limits(machine: MachineConfig) -> MotionLimits:
    """The limits of all axes, in the order of the machine file."""
    limits = [axis.limits for axis in machine.axes.values()]

    def column(values: list[float], unit: float) -> NDArray[np.float64]:
        return np.array(values, dtype=np.float64) * unit

    return MotionLimits(
        position_min_m=column([limit.position_mm[0] for limit in limits], MM),
        position_max_m=column([limit.position_mm[1] for limit in limits], MM),
        velocity_m_s=column([limit.velocity_mm_s for limit in limits], MM),
        acceleration_m_s2=column([limit.acceleration_mm_s2 for limit in limits], MM),
        jerk_m_s3=column([limit.jerk_mm_s3 for limit in limits], MM),
        force_n=column([limit.force_n for limit in limits], 1.0),
    )
