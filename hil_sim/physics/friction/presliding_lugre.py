"""LuGre presliding: the contact's asperities as one bristle that deflects, creeps and slips.

Law: dz/dt = v - sigma0 |v| z / g(v),  F = sigma0 z + sigma1 dz/dt.
    For constant v and g the bristle is solved exactly: z = zs + (z0 - zs) exp(-sigma0 |v| dt / g), zs = g
    sgn(v) / sigma0.
Source: Canudas de Wit, Olsson, Astrom, Lischinsky (1995), equations (1) to (3); g(v) is the sum of the
    friction levels, with Coulomb and Stribeck friction the curve of Xia et al., equation (8).
Symbols: z bristle deflection m; sigma0 `stiffness_n_m` N/m; sigma1 `bristle_damping_n_s_m` N s/m; g level
    N; v m/s.
Valid: one reversal at a time; inner loops of the hysteresis do not close (drift), use presliding_gms if that
    matters.
Catalogue: presliding_hysteresis.
Confused with: backlash (the loop is in force, not in position) -> compare encoder and scale; a smoothed sign
    function, which has no memory of the distance -> strokes below 10 um at several speeds.
"""

import math
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.PRESLIDING
NEEDS = "coulomb_friction"
LEVEL_MIN_N = 1e-9
"""A lower friction level counts as none, which prevents a division by zero; chosen."""


class Params(NamedTuple):
    """Stiffness and damping of the bristle."""

    stiffness_n_m: Annotated[float, Quantity("N/m", 1e3, 1e9, "bristle stiffness sigma0", "N/um")]
    bristle_damping_n_s_m: Annotated[float, Quantity("N s/m", 0.0, 1e6, "bristle damping sigma1")]


class State(NamedTuple):
    """Deflection of the bristle (m)."""

    bristle_m: float = 0.0


NEUTRAL = None
"""No values remove the bristle: without the section the contact is rigid (see coulomb_friction)."""


def sticking_stiffness_n_m(p: Params) -> float:
    """Return the stiffness (N/m) while the contact sticks."""
    return p.stiffness_n_m


@kernel
def force_and_damping(p: Any, s: Any, velocity_m_s: float, level: float) -> tuple[float, float]:
    """Return the bristle force (N), and the damping (N s/m) of sigma1 dz/dt by the velocity.

    The damping is never negative, so that the bristle adds no energy to the table at any sigma1.
    """
    if level < LEVEL_MIN_N:
        return 0.0, 0.0
    relative = p.stiffness_n_m * s.bristle_m / level
    creep = 1.0 - math.copysign(relative, relative * velocity_m_s)
    return float(p.stiffness_n_m * s.bristle_m), float(p.bristle_damping_n_s_m * max(0.0, creep))


@kernel
def slide(p: Any, s: Any, velocity_m_s: float, level: float, dt_s: float) -> None:
    """Advance the deflection `s.bristle_m` (m) by `dt_s` at constant velocity and level."""
    if level < LEVEL_MIN_N:
        s.bristle_m = 0.0
        return
    slip_m = level / p.stiffness_n_m
    steady_m = math.copysign(slip_m, velocity_m_s)
    s.bristle_m = steady_m + (s.bristle_m - steady_m) * math.exp(-abs(velocity_m_s) * dt_s / slip_m)
