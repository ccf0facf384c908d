"""Asymmetric viscous friction: friction grows faster with the speed in one direction than in the other.

Law: F += h |v|, so that Fv+ = Fv + h and Fv- = Fv - h; the sum of the dampings is never below zero.
Source: mismatch catalogue, entry asymmetric_viscous_friction (Fv+ / Fv-); Armstrong-Helouvry, Dupont,
    Canudas de Wit (1994).
Symbols: F friction force N; h `half_difference_n_s_m` half of Fv+ minus Fv- N s/m; v velocity m/s.
Valid: as viscous_friction.
Confused with: asymmetric_coulomb_friction -> move at several speeds: its difference is equal at all speeds.
"""

from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.DAMPING
NEEDS = "viscous_friction"


class Params(NamedTuple):
    """Half of the difference, signed."""

    half_difference_n_s_m: Annotated[float, Quantity("N s/m", -1e5, 1e5, "half of Fv+ minus Fv-, h")]


NEUTRAL = Params(half_difference_n_s_m=0.0)


@kernel
def damping_n_s_m(p: Any, velocity_m_s: float) -> float:
    """Return the addition to the damping (N s/m) in the direction of this velocity (m/s)."""
    return float(p.half_difference_n_s_m if velocity_m_s > 0.0 else -p.half_difference_n_s_m)
