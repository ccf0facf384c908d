"""Conversion between SI units and the integers of drive and scale: counts and per mille.

x_m      = counts / counts_per_rev * lead_m
force_n  = torque_nm * 2 pi / lead_m,  torque in per mille of 6076h,  current in per mille of 6075h
"""

import math
from typing import NamedTuple

from servo_ctrl.config.drive_units import drive_unit
from servo_ctrl.config.model import AxisConfig


class DriveScaling(NamedTuple):
    """SI units per device unit of one drive, at the table."""

    metre_per_count: float
    newton_per_permille: float
    ampere_per_permille: float
    newton_per_ampere: float
    metre_per_s_per_unit: float
    """Unit of velocities."""
    metre_per_s2_per_unit: float
    """Unit of accelerations."""


def drive_scaling(axis: AxisConfig) -> DriveScaling:
    """Return the scaling of an axis according to the machine file; boot compares it with the drive's."""
    lead_m = axis.transmission.lead_mm * 1e-3
    rated_torque_nm = axis.drive.rated_torque_mnm * 1e-3
    metre_per_count = lead_m / axis.drive.counts_per_rev
    velocity = drive_unit(axis.drive.velocity_unit, axis.drive.counts_per_rev)
    acceleration = drive_unit(axis.drive.acceleration_unit, axis.drive.counts_per_rev)
    return DriveScaling(
        metre_per_count=metre_per_count,
        newton_per_permille=rated_torque_nm * 1e-3 * 2.0 * math.pi / lead_m,
        ampere_per_permille=axis.drive.rated_current_ma * 1e-6,
        newton_per_ampere=axis.drive.torque_constant_nm_a * 2.0 * math.pi / lead_m,
        metre_per_s_per_unit=velocity.counts * metre_per_count,
        metre_per_s2_per_unit=acceleration.counts * metre_per_count,
    )


def scale_metre_per_count(axis: AxisConfig) -> float:
    """Return the length of one count of the linear scale, metres; 0 without a scale."""
    return axis.scale.resolution_um * 1e-6 if axis.scale is not None else 0.0


def to_integer(value: float, unit: float, lowest: int, highest: int) -> int:
    """Round `value` to whole multiples of `unit`, half to even, limited to [lowest, highest]; NaN gives 0."""
    multiple = value / unit
    if lowest <= multiple <= highest:
        return round(multiple)
    if math.isnan(multiple):
        return 0
    return lowest if multiple < lowest else highest
