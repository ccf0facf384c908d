"""Velocity and acceleration feedforward (Feng et al. 2015, section 2)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from servo_ctrl.control.jit import kernel

if TYPE_CHECKING:
    from servo_ctrl.control.params import Feedforward


@kernel
def velocity_feedforward(p: Feedforward, velocity_command_m_s: float) -> float:
    """What is added to the velocity set point, m/s."""
    return p.velocity * velocity_command_m_s


@kernel
def acceleration_feedforward(p: Feedforward, acceleration_command_m_s2: float) -> float:
    """What is added to the force set point, newtons: M a."""
    return p.acceleration_kg * acceleration_command_m_s2
