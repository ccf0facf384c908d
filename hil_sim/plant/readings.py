"""Computes the readings of encoder and scale: positions with the errors of the sensors, in counts."""

import math
from typing import Any

from hil_sim.physics.kinds import Kind
from hil_sim.physics.registry import of_kind
from hil_sim.physics.sensor import encoder, scale
from hil_sim.plant.measured_point import measured_point_m
from kernels.jit import kernel
from kernels.unrolled import unrolled

ENCODER_ERRORS = of_kind(Kind.ENCODER_READING)
SCALE_ERRORS = of_kind(Kind.SCALE_READING)
CROSS_ERRORS = of_kind(Kind.CROSS_READING)


@kernel
@unrolled
def encoder_counts(p: Any, s: Any) -> int:
    """Return the counts of the motor encoder from the machine's zero."""
    position_m = s.motor_position_m
    turn_rad_m = 2.0 * math.pi / p.mechanics.lead_m
    for effect in ENCODER_ERRORS:
        if p[effect].enabled:
            position_m += effect.error_m(p[effect], s[effect], s.motor_position_m, turn_rad_m)
    return encoder.counts(p.encoder, position_m)


@kernel
@unrolled
def scale_counts(p: Any, s: Any) -> int:
    """Return the counts of the scale from the machine's zero."""
    point_m = measured_point_m(p, s)
    position_m = point_m
    turn_rad_m = 2.0 * math.pi / p.mechanics.lead_m
    for effect in SCALE_ERRORS:
        if p[effect].enabled:
            position_m += effect.error_m(p[effect], s[effect], point_m, turn_rad_m)
    for effect in CROSS_ERRORS:
        if p[effect].enabled:
            position_m += effect.error_m(p[effect], s[effect])
    return scale.counts(p.scale, position_m)
