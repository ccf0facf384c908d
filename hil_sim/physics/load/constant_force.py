"""Constant force: gravity on an inclined or vertical axis, a counterbalance, an offset of the amplifier.

Law: F = F0.
Source: the offset of the EMPS reference model (Janot, Gautier, Brunot 2019); gravity m g sin(slope).
Symbols: F force on the table N, positive towards positive positions; F0 `force_n` N.
Valid: constant over the travel (a cable chain or a spring is position_dependent_force).
Confused with: asymmetric_coulomb_friction, identical while moving -> compare the breakaway forces of both
    directions from rest: a constant force shifts them apart, with asymmetric friction they are equal.
"""

from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.TABLE_FORCE
COMMON = True


class Params(NamedTuple):
    """The force with its sign."""

    force_n: Annotated[float, Quantity("N", -1e4, 1e4, "force on the table F0")]


NEUTRAL = Params(force_n=0.0)


@kernel
def force_n(p: Any, _position_m: float, _turn_rad_m: float) -> float:
    """Return the force on the table (N)."""
    return float(p.force_n)
