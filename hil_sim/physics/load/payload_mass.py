"""Payload: additional mass on the table.

Law: m = m_table + mp.
Source: mismatch catalogue, entry payload_mass; Newton's second law.
Symbols: m moving mass kg; mp `mass_kg` kg.
Valid: clamped to the table; carried elastically it is structural_mode. On a vertical axis its weight is a
    constant_force.
Confused with: a lower torque constant, which also lacks force in accelerations -> it also changes apparent
    friction and gravity; a known added mass decides.
"""

from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.MASS


class Params(NamedTuple):
    """The added mass."""

    mass_kg: Annotated[float, Quantity("kg", 0.0, 1e5, "added mass mp")]


NEUTRAL = Params(mass_kg=0.0)


@kernel
def added_kg(p: Any) -> float:
    """Return the added mass on the table (kg)."""
    return float(p.mass_kg)
