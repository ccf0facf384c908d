"""Computes the motor force on the screw from the reported current.

The drive reports `current_a` on the bus: the current before the effects composed here.
"""

from typing import Any

from hil_sim.physics.kinds import Kind
from hil_sim.physics.registry import of_kind
from kernels.jit import kernel
from kernels.unrolled import unrolled

CURRENT_PATH = of_kind(Kind.CURRENT_PATH)
FORCE_RIPPLES = of_kind(Kind.FORCE_RIPPLE)
MOTOR_FORCES = of_kind(Kind.MOTOR_FORCE)


@kernel
@unrolled
def acting_current_a(p: Any, s: Any, turn_rad_m: float, dt_s: float) -> float:
    """Return the force-producing current (A) at the nominal force constant, after losses and delays."""
    current = s.current_a
    back_emf_v = p.mechanics.force_constant_n_a * s.motor_velocity_m_s
    for effect in CURRENT_PATH:
        if p[effect].enabled:
            current = effect.force_producing_a(p[effect], s[effect], current, back_emf_v, dt_s)
    for effect in FORCE_RIPPLES:
        if p[effect].enabled:
            current *= 1.0 + effect.relative_ripple(p[effect], s[effect], s.motor_position_m, turn_rad_m)
    return float(current)


@kernel
@unrolled
def motor_force_n(p: Any, s: Any, has_current_path: bool, turn_rad_m: float, dt_s: float) -> float:
    """Return the sum of the forces on the motor side (N).

    `has_current_path`: whether any effect of `acting_current_a` is present.
    """
    current = acting_current_a(p, s, turn_rad_m, dt_s) if has_current_path else s.current_a
    force = p.mechanics.force_constant_n_a * current
    for effect in MOTOR_FORCES:
        if p[effect].enabled:
            force += effect.force_n(p[effect], s[effect], s.motor_position_m, turn_rad_m)
    return float(force)
