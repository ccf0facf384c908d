"""Inertial coupling of two joints: a link that hangs on a moved joint pushes back when either accelerates.

Law: on the outer joint  F = -(J + h cos q2') a1 - h sin q2' v1^2;
    on the inner joint   F = -(J + h cos q2') a2 + h sin q2' (2 v1 v2 + v2^2), and its mass grows by
    2 h cos q2'.
Source: Lagrange's equations of two links in a plane, as in every textbook on robots (Spong, Hutchinson,
    Vidyasagar, Robot Modeling and Control, 2006, section 7.3.2).
Symbols: F force on the table N (N m if 1 m stands for 1 rad); v1, v2 and a1, a2 velocities m/s and
    accelerations m/s^2 of the inner and the outer joint, of which `outer` says which one this is, and `other`
    names the other; q2' = q2 + p; q2 position of the outer joint, measured from the inner link, rad; J
    `inertia_kg` of the outer link about its joint; h `arm_kg` mass of the outer link times the distance of
    its centre times the length of the inner link; p `phase_rad` angle between the links at position zero.
Valid: parallel axes, rigid links, 1 m stands for 1 rad, and (J + h)^2 below the product of the moved masses.
    The other axis is taken as it was one substep before. h = 0: two motors on one body, as of a gantry.
Confused with: payload_mass if both axes always accelerate together -> move them one after the other.
"""

import math
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind, OtherAxis
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.FORCE_OF_OTHER_AXIS
State = OtherAxis


class Params(NamedTuple):
    """The other joint, which of the two is the outer, and the outer link."""

    other: Annotated[float, Quantity("", 0.0, 15.0, "the other joint", "axis")]
    outer: Annotated[float, Quantity("", 0.0, 1.0, "1: this is the outer joint; 0: the inner")]
    inertia_kg: Annotated[float, Quantity("kg", -1e6, 1e6, "inertia J of the outer link about its joint")]
    arm_kg: Annotated[float, Quantity("kg", -1e6, 1e6, "coupling h that turns with the outer joint")] = 0.0
    phase_rad: Annotated[float, Quantity("rad", -7.0, 7.0, "phase p at the position zero", "deg")] = 0.0


NEUTRAL = Params(other=0.0, outer=1.0, inertia_kg=0.0)


@kernel
def force_n(p: Any, s: Any, position_m: float, velocity_m_s: float) -> float:
    """Return the force on the table (N) at its position (m) and velocity (m/s)."""
    if p.outer > 0.0:
        angle_rad = position_m + p.phase_rad
        centrifugal_m_s2 = s.velocity_m_s * s.velocity_m_s
        sign = -1.0
    else:
        angle_rad = s.position_m + p.phase_rad
        centrifugal_m_s2 = (2.0 * velocity_m_s + s.velocity_m_s) * s.velocity_m_s
        sign = 1.0
    coupled_kg = p.inertia_kg + p.arm_kg * math.cos(angle_rad)
    return float(-coupled_kg * s.acceleration_m_s2 + sign * p.arm_kg * math.sin(angle_rad) * centrifugal_m_s2)


@kernel
def added_kg(p: Any, s: Any) -> float:
    """Return the addition to the mass (kg) at the position of the other joint."""
    return 0.0 if p.outer > 0.0 else float(2.0 * p.arm_kg * math.cos(s.position_m + p.phase_rad))
