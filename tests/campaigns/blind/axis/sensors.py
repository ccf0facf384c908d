"""What encoder and scale see without noise: lead error, eccentricity, interpolation error."""

import math

from tests.campaigns.blind.axis.bodies import SECOND_PHASE_RAD, Bodies
from tests.campaigns.blind.compiled import compiled
from tests.campaigns.blind.nonlinearities import wave
from tests.campaigns.blind.plant import Plant


@compiled
def table_position_m(p: Plant, bodies: Bodies, start_m: float) -> float:
    """Return where the table is; that of a rigid axis follows the motor with the lead error of the screw."""
    if p.has_compliance != 0.0:
        return bodies.table_m
    angle = p.lead_error_1_m * (bodies.motor_m + start_m) + p.lead_error_phase_rad
    lead_error = p.lead_error_m * math.sin(angle)
    lead_error += p.lead_error_second_m * math.sin(2.0 * angle + SECOND_PHASE_RAD)
    return bodies.motor_m + lead_error


@compiled
def encoder_m(p: Plant, motor_m: float, start_m: float) -> float:
    """Return the encoder's reading of the motor."""
    angle = p.eccentricity_1_m * (motor_m + start_m) + p.eccentricity_phase_rad
    return motor_m + p.eccentricity_m * math.sin(angle)


@compiled
def scale_m(p: Plant, table_m: float, start_m: float) -> float:
    """Return the scale's reading of the table, from its own origin."""
    angle = p.interpolation_error_1_m * (table_m + start_m) + p.interpolation_error_phase_rad
    reading: float = table_m * (1.0 + p.relative_lead_error) + p.interpolation_error_m * wave(
        angle, p.interpolation_error_skew
    )
    return reading
