"""Load-dependent friction: friction of gears, screws and bearings grows with the force that they transmit.

Law: level += mu |Ft - (1 - a) Ff|.
Source: Duclusaud, Passault, Padois, Ly (2025), Extended friction models for the physics simulation of servo
    actuators: their model M6 has friction that grows with the load; without its Stribeck part and with one
    coefficient for driving and driven motion. Theirs is the motor's torque, a = 1.
Symbols: mu `load_share`; a `friction_share`; Ft force N that the drive transmits; Ff the friction in it.
    Without it (a = 0) the load is inertia of the table and external forces.
Valid: moderate loads; mu is below 1 if the axis can be driven back. The level follows the load of the
    previous substep.
Confused with: asymmetric_coulomb_friction under a constant load; a higher payload_mass under inertial load
    alone -> the sign of the difference between acceleration and deceleration.
"""

from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.FRICTION_LOAD
NEEDS = "coulomb_friction"


class Params(NamedTuple):
    """The coefficient, and the part of friction that counts as load."""

    load_share: Annotated[float, Quantity("", 0.0, 0.9, "share mu of the load")]
    friction_share: Annotated[float, Quantity("", 0.0, 1.0, "share a of the friction that is load")] = 0.0


NEUTRAL = Params(load_share=0.0)


@kernel
def level_n(p: Any, transmitted_n: float, friction_n: float) -> float:
    """Return the addition to the friction level (N) at a transmitted force (N) and the friction in it (N)."""
    return float(p.load_share * abs(transmitted_n - (1.0 - p.friction_share) * friction_n))
