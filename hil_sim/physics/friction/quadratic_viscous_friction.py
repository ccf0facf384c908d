"""Quadratic viscous friction: a force in proportion to the square of the speed.

Law: F = F2 v |v|, as a damping F2 |v|; the sum of the dampings is never below zero.
Source: mismatch catalogue, entry quadratic_viscous_friction; the drag of a turbulent fluid,
    Newton's law of resistance.
Symbols: F friction force N; F2 `quadratic_n_s2_m2` N s^2/m^2, negative if friction grows slower than the
    speed (a shear-thinning film); v velocity m/s.
Valid: fast bearings in oil, a fan, a bellows; negative F2 only at the speeds where it was identified.
Confused with: viscous_friction -> move at several speeds: force per speed is constant there and grows here;
    torque_constant_saturation -> depends on the force, not on the speed.
"""

from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.DAMPING


class Params(NamedTuple):
    """The coefficient."""

    quadratic_n_s2_m2: Annotated[float, Quantity("N s2/m2", -1e6, 1e6, "coefficient F2")]


NEUTRAL = Params(quadratic_n_s2_m2=0.0)


@kernel
def damping_n_s_m(p: Any, velocity_m_s: float) -> float:
    """Return the damping coefficient (N s/m) at a velocity (m/s)."""
    return float(p.quadratic_n_s2_m2 * abs(velocity_m_s))
