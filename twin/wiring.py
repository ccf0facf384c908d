"""The scalings of the integers on the bus, of both sides, for the batch twin."""

from typing import NamedTuple

from hil_sim.config import AxisPlant
from servo_ctrl.canopen.scaling import drive_scaling, scale_metre_per_count
from servo_ctrl.canopen.settings import force_limit_permille
from servo_ctrl.config.drive_units import drive_unit
from servo_ctrl.config.model import AxisConfig
from servo_ctrl.config.node_model import TORQUE_OFFSET, VELOCITY_OFFSET, is_mapped

IMMEDIATE_TYPES = (254, 255)


class Wires(NamedTuple):
    """Scalings of the integers on the bus, as each of the two processes computes them."""

    metre_per_count: float
    newton_per_permille: float
    ampere_per_permille: float
    newton_per_ampere: float
    scale_metre_per_count: float
    drive_metre_per_count: float
    metre_per_s_per_unit: float
    drive_metre_per_s_per_unit: float
    drive_ampere_per_torque: float
    drive_permille_per_ampere: float
    max_torque: int
    current_limit_a: float
    immediate: bool
    torque_offset_mapped: bool
    velocity_offset_mapped: bool


def wires_of(control: AxisConfig, plant: AxisPlant) -> Wires:
    """Return the scalings of one axis, with the expressions of `canopen.scaling` and of the drive's port."""
    unit = drive_scaling(control)
    motor = plant.motor
    max_torque, max_current = force_limit_permille(control)
    ampere_per_torque = motor.rated_torque_mnm * 1e-3 / 1000.0 / motor.torque_constant_nm_a
    velocity = drive_unit(control.drive.velocity_unit, plant.encoder.counts_per_rev)
    by_current_a = max_current * (motor.rated_current_ma * 1e-3) / 1000.0
    return Wires(
        metre_per_count=unit.metre_per_count,
        newton_per_permille=unit.newton_per_permille,
        ampere_per_permille=unit.ampere_per_permille,
        newton_per_ampere=unit.newton_per_ampere,
        scale_metre_per_count=scale_metre_per_count(control),
        drive_metre_per_count=plant.lead_m / plant.encoder.counts_per_rev,
        metre_per_s_per_unit=unit.metre_per_s_per_unit,
        drive_metre_per_s_per_unit=velocity.counts * (plant.lead_m / plant.encoder.counts_per_rev),
        drive_ampere_per_torque=ampere_per_torque,
        drive_permille_per_ampere=1000.0 / (motor.rated_current_ma * 1e-3),
        max_torque=max_torque,
        current_limit_a=min(max_torque * ampere_per_torque, by_current_a),
        immediate=control.drive.rpdo_transmission_type in IMMEDIATE_TYPES,
        torque_offset_mapped=is_mapped(control.drive.sent, TORQUE_OFFSET),
        velocity_offset_mapped=is_mapped(control.drive.sent, VELOCITY_OFFSET),
    )
