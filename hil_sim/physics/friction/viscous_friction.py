"""Viscous friction: a force in proportion to the velocity.

Law: F = B v.
Source: Xia et al., equation (5), the term B x', and equation (8), the term Q q'.
Symbols: F friction force N; B `viscous_n_s_m` N s/m; v velocity m/s.
Valid: full-film lubrication, small changes of temperature.
Confused with: quadratic_viscous_friction (grows with v^2) -> move at several speeds; the back-EMF of a
    winding without current control, equal in the voltage -> measure the current; velocity feedforward
    errors, which do not appear in the force.
"""

from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.DAMPING
COMMON = True


class Params(NamedTuple):
    """The damping coefficient."""

    viscous_n_s_m: Annotated[float, Quantity("N s/m", 0.0, 1e5, "damping coefficient B")]


NEUTRAL = Params(viscous_n_s_m=0.0)


@kernel
def damping_n_s_m(p: Any, _velocity_m_s: float) -> float:
    """Return the damping coefficient (N s/m); the implicit step is stable at any value."""
    return float(p.viscous_n_s_m)
