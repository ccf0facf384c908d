"""Proportional position loop of the cascade (Feng et al. 2015, section 2)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from servo_ctrl.control.jit import kernel

if TYPE_CHECKING:
    from servo_ctrl.control.types import PositionLoop


@kernel
def feedback_position(p: PositionLoop, motor_position_m: float, scale_position_m: float) -> float:
    """The position, metres, that the loop is closed on."""
    return scale_position_m if p.scale_feedback else motor_position_m


@kernel
def velocity_setpoint(p: PositionLoop, position_error_m: float) -> float:
    """Velocity set point kp e, m/s. Alone on an ideal axis e decays as exp(-kp t)."""
    return p.kp_1_s * position_error_m
