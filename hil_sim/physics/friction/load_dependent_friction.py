"""Load-dependent friction: gears, screws and bearings rub more, the more force they transmit.

Law: level += mu |Fl|.
Source: Duclusaud, Passault, Padois, Ly (2025), Extended friction models for the physics simulation of servo
    actuators: their model M6 has friction that grows with the load; without its Stribeck part and with one
    coefficient for driving and driven motion.
Symbols: mu `load_share`; Fl force N that the drive transmits without friction: inertia of the table and
    external forces.
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
    """The coefficient."""

    load_share: Annotated[float, Quantity("", 0.0, 0.9, "share mu of the transmitted force")]


NEUTRAL = Params(load_share=0.0)


@kernel
def level_n(p: Any, load_n: float) -> float:
    """Return the addition to the friction level (N) at a transmitted force (N)."""
    return float(p.load_share * abs(load_n))
