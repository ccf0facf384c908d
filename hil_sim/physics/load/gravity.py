"""Gravity on a rotary axis: an off-axis centre of mass exerts a moment with the sine of its angle.

Law: F = A sin(k x + p).
Source: the moment of a weight about an axis, m g r sin(angle); the pendulum.
Symbols: F force on the table N, positive towards positive positions; A `amplitude_n` N, m g r divided by the
    lever of the coordinate (N m if 1 m stands for 1 rad); x position m; k `angle_rad_m` angle of the axis per
    coordinate rad/m; p `phase_rad` rad, at position zero.
Valid: a rigid load on an axis that does not tilt. On a linear axis gravity is a constant_force.
Confused with: position_dependent_force, similar over less than half a turn -> gravity repeats after a turn;
    constant_force, similar near the horizontal -> move over a larger angle.
"""

import math
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.TABLE_FORCE


class Params(NamedTuple):
    """Moment and angle of the weight."""

    amplitude_n: Annotated[float, Quantity("N", -1e6, 1e6, "amplitude A")]
    phase_rad: Annotated[float, Quantity("rad", -7.0, 7.0, "phase p at the position zero", "deg")]
    angle_rad_m: Annotated[float, Quantity("rad/m", 1e-3, 1e3, "angle per coordinate k")] = 1.0


NEUTRAL = Params(amplitude_n=0.0, phase_rad=0.0)


@kernel
def force_n(p: Any, position_m: float, _turn_rad_m: float) -> float:
    """Return the force on the table (N)."""
    return float(p.amplitude_n * math.sin(p.angle_rad_m * position_m + p.phase_rad))
