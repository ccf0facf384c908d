"""Velocity and acceleration feedforward (Feng et al. 2015, section 2)."""

import math
from typing import Annotated, NamedTuple

from kernels.jit import kernel
from kernels.quantities import Quantity


class Params(NamedTuple):
    """What is known in advance."""

    velocity: Annotated[float, Quantity("", 0.0, math.inf, "share of the velocity command, 1 = all of it")]
    acceleration_kg: Annotated[float, Quantity("kg", 0.0, math.inf, "moved mass")]


NEUTRAL = Params(velocity=0.0, acceleration_kg=0.0)


@kernel
def velocity_feedforward(p: Params, velocity_command_m_s: float) -> float:
    """What is added to the velocity set point, m/s."""
    return p.velocity * velocity_command_m_s


@kernel
def acceleration_feedforward(p: Params, acceleration_command_m_s2: float) -> float:
    """What is added to the force set point, newtons: M a."""
    return p.acceleration_kg * acceleration_command_m_s2
