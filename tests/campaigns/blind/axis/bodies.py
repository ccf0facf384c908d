"""Motor and table: as one body behind a screw with lead error, or as two with a contact behind a backlash.

The contact is that of Hunt and Crossley (1975), K d^1.5 (1 + c d').
"""

import math
from typing import NamedTuple

from tests.campaigns.blind.compiled import compiled
from tests.campaigns.blind.plant import Plant

SECOND_PHASE_RAD = 0.7
"""Phase of the second harmonic of the lead error against the doubled angle of the first; chosen."""


class Bodies(NamedTuple):
    """Positions and velocities of motor and table."""

    motor_m: float
    motor_m_s: float
    table_m: float
    table_m_s: float


@compiled
def half_moved(p: Plant, b: Bodies, h: float) -> Bodies:
    """Return the bodies after the first half of a step of position; a rigid table is the motor."""
    motor_m = b.motor_m + 0.5 * h * b.motor_m_s
    if p.has_compliance == 0.0:
        return Bodies(motor_m, b.motor_m_s, motor_m, b.motor_m_s)
    return Bodies(motor_m, b.motor_m_s, b.table_m + 0.5 * h * b.table_m_s, b.table_m_s)


@compiled
def one_body(
    p: Plant, b: Bodies, force_n: float, load_n: float, start_m: float, table_kg: float, h: float
) -> Bodies:
    """Return a rigid axis after the step of velocity and the other half of position.

    `force_n` drives the motor, `load_n` brakes the table. The table's velocity stays that before the step.
    """
    x1, v1 = b.motor_m, b.motor_m_s
    angle = p.lead_error_1_m * (x1 + start_m) + p.lead_error_phase_rad
    ratio = 1.0 + p.lead_error_1_m * p.lead_error_m * math.cos(angle)
    ratio += 2.0 * p.lead_error_1_m * p.lead_error_second_m * math.cos(2.0 * angle + SECOND_PHASE_RAD)
    slope = -(p.lead_error_1_m**2) * p.lead_error_m * math.sin(angle)
    slope -= 4.0 * p.lead_error_1_m**2 * p.lead_error_second_m * math.sin(2.0 * angle + SECOND_PHASE_RAD)
    net = force_n - ratio * (load_n + table_kg * slope * v1 * v1)
    v1 += h * net / (p.motor_kg + ratio * ratio * table_kg)
    x1 += 0.5 * h * v1
    return Bodies(x1, v1, x1, b.table_m_s)


@compiled
def two_bodies(
    p: Plant,
    b: Bodies,
    force_n: float,
    friction_n: float,
    load_n: float,
    start_m: float,
    table_kg: float,
    h: float,
) -> Bodies:
    """Return an axis with a contact after the step of velocity and the other half of position.

    `force_n` drives the motor, the table's own friction and the load brake the table.
    """
    x1, v1, x2, v2 = b
    lead_error_m = p.lead_error_m * math.sin(p.lead_error_1_m * (x1 + start_m) + p.lead_error_phase_rad)
    twist_m = x1 + lead_error_m - x2
    compression_m = abs(twist_m) - 0.5 * p.backlash_gap_m
    contact_n = 0.0
    if compression_m > 0.0:
        side = 1.0 if twist_m > 0.0 else -1.0
        closing = side * (v1 - v2)
        contact_n = (
            p.contact_stiffness * compression_m**p.contact_power * (1.0 + p.contact_loss_s_m * closing)
        )
        contact_n += p.spring_n_s_m * closing
        contact_n = side * max(contact_n, 0.0)
    v1 += h * (force_n - contact_n) / p.motor_kg
    v2 += h * (contact_n - friction_n - load_n) / table_kg
    x2 += 0.5 * h * v2
    x1 += 0.5 * h * v1
    return Bodies(x1, v1, x2, v2)
