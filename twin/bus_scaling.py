"""Scalings of the integers that the bus would carry, on both its sides, and the constants of an axis."""

import math
from typing import NamedTuple

from hil_sim.config import AxisPlant, PlantConfig
from servo_ctrl.axis.axis_parts import axis_bounds, drive_route
from servo_ctrl.axis.supervision import supervision_limits
from servo_ctrl.canopen.scaling import drive_scaling, scale_metre_per_count
from servo_ctrl.canopen.settings import force_limit_permille
from servo_ctrl.config.drive_units import drive_unit
from servo_ctrl.config.model import AxisConfig, MachineConfig
from servo_ctrl.config.node_model import TORQUE_OFFSET, VELOCITY_OFFSET, is_mapped
from servo_ctrl.control.set_point_counts import SetPointUnits
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.cyclic.axis_record import AxisParts, InputPlace, Wiring

IMMEDIATE_TYPES = (254, 255)
"""Event-driven transmission types of an RPDO: its set points take effect on reception."""
_UNMAPPED = InputPlace(0, 0, 0, signed=False)
NO_BUS = Wiring(
    drive=0,
    further=0,
    further_count=0,
    scale=-1,
    statusword=_UNMAPPED,
    position=_UNMAPPED,
    current=_UNMAPPED,
    mode_shown=_UNMAPPED,
    scale_position=_UNMAPPED,
    metre_per_count=1.0,
    ampere_per_permille=1.0,
    newton_per_ampere=1.0,
    scale_metre_per_count=1.0,
)
"""No places in PDOs: the twin has no bus."""


class BusScaling(NamedTuple):
    """Scalings of the integers on the bus, as controller and drive (`drive_*`) each compute them.

    `torque` and `permille` are thousandths of rated torque and current, `unit` those of velocity objects.
    """

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
    """Whether set points take effect on reception, not at the next SYNC."""
    torque_offset_mapped: bool
    velocity_offset_mapped: bool


def bus_scaling(control: AxisConfig, plant: AxisPlant) -> BusScaling:
    """Return the scalings of one axis, equal to the bit to `canopen.scaling` and the drive's `AxisPort`."""
    unit = drive_scaling(control)
    motor = plant.motor
    max_torque, max_current = force_limit_permille(control)
    ampere_per_torque = motor.rated_torque_mnm * 1e-3 / 1000.0 / motor.torque_constant_nm_a
    velocity = drive_unit(control.drive.velocity_unit, plant.encoder.counts_per_rev)
    by_current_a = max_current * (motor.rated_current_ma * 1e-3) / 1000.0
    return BusScaling(
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


def axis_parts(control: AxisConfig, params: AxisParams, scaling: BusScaling) -> AxisParts:
    """Return the constants of the controller's record of an axis, without places in PDOs.

    The axis needs no homing: its zero is the position at which its drive is switched on.
    """
    unit = drive_scaling(control)
    return AxisParts(
        params=params,
        units=SetPointUnits(
            scaling.newton_per_permille,
            scaling.metre_per_count,
            scaling.metre_per_s_per_unit,
            scaling.torque_offset_mapped,  # an offset without its own object is part of the set point
            scaling.velocity_offset_mapped,
        ),
        limits=supervision_limits(control, unit, params.period_s),
        route=drive_route(control, params.period_s)._replace(homing=False),
        wiring=NO_BUS._replace(
            metre_per_count=scaling.metre_per_count,
            ampere_per_permille=scaling.ampere_per_permille,
            newton_per_ampere=scaling.newton_per_ampere,
            scale_metre_per_count=scaling.scale_metre_per_count,
        ),
        bounds=axis_bounds(control, unit, params.period_s),
    )


def substeps_of(machine: MachineConfig, plant: PlantConfig) -> int:
    """Return the number of substeps of the plant in one SYNC period.

    Raises:
        ValueError: it is not a whole number.

    """
    substeps = round(machine.bus.sync_period_us / plant.substep_us)
    if substeps < 1 or not math.isclose(substeps * plant.substep_us, machine.bus.sync_period_us):
        raise ValueError("bus.sync_period_us is not a whole number of plant.substep_us")
    return substeps
