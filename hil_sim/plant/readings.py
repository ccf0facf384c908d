"""What encoder and scale read: the positions with the errors of the sensors, in counts."""

from __future__ import annotations

import math
from typing import Any

from hil_sim.physics.jit import kernel
from hil_sim.physics.sensor import (
    cross_axis_coupling,
    encoder,
    encoder_eccentricity,
    scale,
    scale_cyclic_error,
)
from hil_sim.plant.measured_point import measured_point_m


@kernel
def encoder_counts(p: Any, s: Any) -> int:
    """Counts of the motor encoder from the machine's zero."""
    position_m = s.motor_position_m
    if p.encoder_eccentricity.enabled:
        turn_rad_m = 2.0 * math.pi / p.mechanics.lead_m
        position_m += encoder_eccentricity.error_m(p.encoder_eccentricity, s.motor_position_m, turn_rad_m)
    return encoder.counts(p.encoder, position_m)


@kernel
def scale_counts(p: Any, s: Any) -> int:
    """Counts of the scale from the machine's zero."""
    point_m = measured_point_m(p, s)
    position_m = point_m
    if p.scale_cyclic_error.enabled:
        turn_rad_m = 2.0 * math.pi / p.mechanics.lead_m
        position_m += scale_cyclic_error.error_m(p.scale_cyclic_error, point_m, turn_rad_m)
    if p.cross_axis_coupling.enabled:
        position_m += cross_axis_coupling.error_m(p.cross_axis_coupling, s.other_position_m)
    return scale.counts(p.scale, position_m)
