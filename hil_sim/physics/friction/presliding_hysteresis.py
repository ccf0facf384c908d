"""Presliding hysteresis: a part of friction that builds up over the distance since the reversal.

Law: dz/dt = v - |v| z / d,  F = L z / d; after a reversal F approaches +-L as L (1 - 2 exp(-x / d)), from
    rest as L (1 - exp(-x / d)). For constant v the step is exact: z = zs + (z0 - zs) exp(-|v| dt / d), zs =
    d sgn(v).
Source: Dahl (1968), with exponent 1; mismatch catalogue, entry presliding_hysteresis.
Symbols: F friction force N, added to the other levels; L `level_n` N; d `way_m` m, distance from rest for
    63 % of L; z deflection m, at most d; x distance since the reversal m; v velocity m/s.
Valid: the shape of one reversal; inner loops do not close, and it does not follow the fall of the level with
    speed. The richer models presliding_lugre and presliding_gms shape all other levels; this one adds its
    own level, beside which levels without presliding may remain.
Confused with: backlash (the loop is in force, not in position) -> compare encoder and scale; a smoothed sign
    function, which has no memory of the distance -> strokes below 10 um at several speeds.
"""

import math
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.PRESLIDING_LEVEL
LEVEL_MIN_N = 1e-9
"""A lower friction level counts as none, which prevents a division by zero; chosen."""


class Params(NamedTuple):
    """Level, and the distance over which it builds up."""

    level_n: Annotated[float, Quantity("N", 0.0, 1e4, "friction level L")]
    way_m: Annotated[float, Quantity("m", 1e-7, 1e-2, "distance d to 63 % of it", "um")]


class State(NamedTuple):
    """Deflection of the contact (m)."""

    deflection_m: float = 0.0


NEUTRAL = Params(level_n=0.0, way_m=1e-5)


def sticking_stiffness_n_m(p: Params) -> float:
    """Return the stiffness (N/m) while the contact sticks."""
    return p.level_n / p.way_m


@kernel
def force_and_damping(p: Any, s: Any, _velocity_m_s: float, level: float) -> tuple[float, float]:
    """Return the force (N) of `s.deflection_m`, and no damping; `level` (N) is L with its changes in use."""
    if level < LEVEL_MIN_N:
        return 0.0, 0.0
    return float(p.level_n / p.way_m * s.deflection_m), 0.0


@kernel
def slide(p: Any, s: Any, velocity_m_s: float, level: float, dt_s: float) -> None:
    """Advance the deflection by `dt_s` at constant velocity; a change of the level keeps the stiffness."""
    if level < LEVEL_MIN_N or p.level_n < LEVEL_MIN_N:
        s.deflection_m = 0.0
        return
    distance_m = level / p.level_n * p.way_m
    steady_m = math.copysign(distance_m, velocity_m_s)
    decay = math.exp(-abs(velocity_m_s) * dt_s / distance_m)
    s.deflection_m = steady_m + (s.deflection_m - steady_m) * decay
