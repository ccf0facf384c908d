"""Gravity of an outer link: a weight whose angle is the sum of two joints, felt at both of them.

Law: F = A sin(x + k xo + p).
Source: the moment of a weight about an axis, m g r sin(angle), of the second link of a double pendulum.
Symbols: F force on the table N, positive towards positive positions; A `amplitude_n` N, m g r (N m if 1 m
    stands for 1 rad); x position of this joint, xo of the joint `other` rad; k `sense` 1 if both turn in the
    same sense, -1 otherwise; p `phase_rad` rad, at positions zero.
Valid: parallel joints that do not tilt, rigid links. The other axis is taken as it was one substep before.
Confused with: gravity, if the other joint stands -> move the other joint.
"""

import math
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind, OtherAxis
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.FORCE_OF_OTHER_AXIS
State = OtherAxis


class Params(NamedTuple):
    """The other joint, and moment and angle of the weight."""

    other: Annotated[float, Quantity("", 0.0, 15.0, "the other joint", "axis")]
    amplitude_n: Annotated[float, Quantity("N", -1e6, 1e6, "amplitude A")]
    phase_rad: Annotated[float, Quantity("rad", -7.0, 7.0, "phase p at the positions zero", "deg")] = 0.0
    sense: Annotated[float, Quantity("", -1.0, 1.0, "sense k of the other joint")] = 1.0


NEUTRAL = Params(other=0.0, amplitude_n=0.0)


@kernel
def force_n(p: Any, s: Any, position_m: float, _velocity_m_s: float) -> float:
    """Return the force on the table (N) at its position (m)."""
    return float(p.amplitude_n * math.sin(position_m + p.sense * s.position_m + p.phase_rad))


@kernel
def added_kg(_p: Any, _s: Any) -> float:
    """Return no addition to the mass (kg)."""
    return 0.0
