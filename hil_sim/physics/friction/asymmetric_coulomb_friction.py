"""Asymmetric Coulomb friction: friction is higher in one direction than in the other.

Law: level += h sgn(v), so that Fc+ = Fc + h and Fc- = Fc - h; at rest level += |h| for a push in either
    direction. The sum of the levels is never below zero.
Source: mismatch catalogue, entry asymmetric_coulomb_friction (Fc+ / Fc-); Armstrong-Helouvry, Dupont,
    Canudas de Wit (1994); on the EMPS axis, Janot, Gautier, Brunot (2019), from the wear of the screw.
Symbols: h `half_difference_n` half of Fc+ minus Fc- N; v sliding velocity m/s.
Valid: sliding, for causes that act only in sliding (a seal lip, a worn flank). At rest the contact has no
    direction and holds with the higher level (chosen).
Confused with: constant_force, identical while moving -> breakaway from rest in both directions: a constant
    force shifts the two breakaway forces apart, here they are equal.
"""

from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.FRICTION_DIRECTION
NEEDS = "coulomb_friction"


class Params(NamedTuple):
    """Half of the difference, signed."""

    half_difference_n: Annotated[float, Quantity("N", -1e4, 1e4, "half of Fc+ minus Fc-, h")]


NEUTRAL = Params(half_difference_n=0.0)


@kernel
def level_n(p: Any, direction: float) -> float:
    """Return the addition to the friction level (N) in this direction: 1, -1, or 0 at rest."""
    if direction == 0.0:
        return float(abs(p.half_difference_n))
    return float(p.half_difference_n * direction)
