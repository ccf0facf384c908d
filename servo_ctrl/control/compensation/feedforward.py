"""Velocity and acceleration feedforward (Feng et al. 2015, section 2): the tick adds k v* and M a*."""

import math
from typing import Annotated, NamedTuple

from kernels.quantities import Quantity


class Params(NamedTuple):
    """Gains of the feedforward."""

    velocity: Annotated[float, Quantity("", 0.0, math.inf, "share of the velocity command, 1 = all of it")]
    acceleration_kg: Annotated[float, Quantity("kg", 0.0, math.inf, "moved mass")]


NEUTRAL = Params(velocity=0.0, acceleration_kg=0.0)
