"""Coulomb friction: a force of constant size against the motion, and stiction below it.

Law: F = Fc sgn(v) while sliding; at rest F balances any force up to Fc.
Source: Xia et al., equations (5) and (8), the terms F and Fc; the time step is the impulse form of
    Stewart and Trinkle (1996): the friction impulse of a step is the one that stops the body, limited to Fc
    dt.
Symbols: F friction force N; Fc `coulomb_n` N; v sliding velocity m/s; m mass kg; dt time step s.
Valid: dry or boundary-lubricated guides above presliding displacements (> 10-100 um after a reversal).
Confused with: constant_force, identical in one direction -> move in both directions: friction is odd in v;
    presliding_hysteresis -> strokes below 10 um show a spring, pure Coulomb friction does not move.
"""

import math
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.FRICTION_LEVEL
COMMON = True


class Params(NamedTuple):
    """Size of the kinetic friction force."""

    coulomb_n: Annotated[float, Quantity("N", 0.0, 1e4, "kinetic friction force Fc")]


NEUTRAL = Params(coulomb_n=0.0)


@kernel
def level_n(p: Any, _speed_m_s: float) -> float:
    """Return the friction level Fc (N), which does not depend on the sliding speed."""
    return float(p.coulomb_n)


@kernel
def stick_or_slide_m_s(velocity_m_s: float, level: float, mass_kg: float, dt_s: float) -> float:
    """Return the velocity (m/s) after the friction impulse of one step; exactly 0.0 while the body sticks.

    `velocity_m_s` is the velocity from all other forces, `level` the friction level (N). The sign is that at
    the end of the step, so that the velocity does not chatter about zero.
    """
    remaining = abs(velocity_m_s) - level * dt_s / mass_kg
    return math.copysign(remaining, velocity_m_s) if remaining > 0.0 else 0.0
