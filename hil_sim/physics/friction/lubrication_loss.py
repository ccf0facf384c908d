"""Lubrication loss: the contact runs dry once, and friction changes to another level.

Law: f = 1 + (F - 1) clip((t - t0) / Td, 0, 1), with one F for the levels and one for the damping.
Source: Feng et al. (2015), section 1 (greatly changed friction); by the curve of Stribeck (1902) boundary
    friction is a multiple of film friction. The linear transition is chosen.
Symbols: f factor on friction; t time since power-up s; t0 `start_s` s; Td `transition_s` s, a step if it
    is short; F `level_factor` and `damping_factor`.
Valid: one event, without the thinning of the film before it.
Confused with: friction_ageing -> stops at rest; temperature_dependent_friction -> returns with cooling; a
    payload, which also adds inertia -> accelerate.
"""

from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.FRICTION_CHANGE
NEEDS = "coulomb_friction"
ORDER = 2  # place in the product of the factors


class Params(NamedTuple):
    """Start, duration and size of the change."""

    start_s: Annotated[float, Quantity("s", 0.0, 1e7, "time since power-up t0 at which it begins")]
    transition_s: Annotated[float, Quantity("s", 1e-3, 1e6, "duration Td of the transition")]
    level_factor: Annotated[float, Quantity("", 0.0, 20.0, "factor on the friction levels afterwards")]
    damping_factor: Annotated[float, Quantity("", 0.0, 20.0, "factor on the viscous damping afterwards")]


NEUTRAL = Params(start_s=0.0, transition_s=1.0, level_factor=1.0, damping_factor=1.0)


@kernel
def factors(p: Any, time_s: float) -> tuple[float, float]:
    """Return the factors on the friction levels and on the damping at a time since power-up (s)."""
    completed = min(1.0, max(0.0, (time_s - p.start_s) / p.transition_s))
    return float(1.0 + (p.level_factor - 1.0) * completed), float(1.0 + (p.damping_factor - 1.0) * completed)
