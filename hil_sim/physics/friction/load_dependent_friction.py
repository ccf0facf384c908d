"""Load-dependent friction: gears, screws and bearings rub more, the more force they transmit.

Law: level += mu |Fl|.
Source: Duclusaud, Passault, Padois, Ly (2025), Extended friction models for the physics simulation of servo
    actuators: their model M6 has friction that grows with the load; without its Stribeck part and with one
    coefficient for driving and driven motion.
Symbols: mu `load_share`; Fl force N that the drive transmits, friction left out: inertia of the table and
    forces from outside.
Valid: moderate loads; where the axis can be driven back, mu is below 1. The level follows the load of the
    substep before.
Confused with: asymmetric_coulomb_friction under a constant load, a higher payload_mass where only inertia
    loads -> the sign of the difference between speeding up and braking.
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
    """What the friction level has more (N) at a transmitted force (N)."""
    return float(p.load_share * abs(load_n))
