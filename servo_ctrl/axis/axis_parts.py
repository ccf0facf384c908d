"""Converts machine file and PDO mappings to the parameter records of the compiled cycle."""

from collections.abc import Mapping, Sequence

import numpy as np

from kernels.arrays import Index
from servo_ctrl.axis.supervision import supervision_limits
from servo_ctrl.canopen.errors import EdsError
from servo_ctrl.canopen.pdo import MappedObject, PdoCodec
from servo_ctrl.canopen.scaling import DriveScaling, drive_scaling, scale_metre_per_count
from servo_ctrl.config.model import AxisConfig
from servo_ctrl.control.set_point_counts import SetPointUnits
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.cyclic.axis_record import AxisBounds, AxisParts, InputPlace, Wiring
from servo_ctrl.cyclic.cia402 import MODE_OF_NAME
from servo_ctrl.cyclic.pdo_bytes import RpdoValue
from servo_ctrl.cyclic.sequence import COASTS_M_S
from servo_ctrl.cyclic.sequence_state import Route

STATUSWORD, POSITION_ACTUAL_VALUE, CURRENT_ACTUAL_VALUE = (0x6041, 0), (0x6064, 0), (0x6078, 0)
MODE_DISPLAY = (0x6061, 0)
"""Index and subindex of objects of CiA 402."""
POSITION_VALUE = (0x6004, 0)
"""Index and subindex of the position value of a scale (CiA 406)."""
TORQUE_OFFSET = 0x60B2
RPDO_VALUE_OF_INDEX: dict[int, RpdoValue] = {
    0x6040: RpdoValue.CONTROLWORD,
    0x6060: RpdoValue.MODE,
    0x60B0: RpdoValue.ZERO,  # position offset: in csp the position set point contains the correction
    0x6071: RpdoValue.TORQUE,
    TORQUE_OFFSET: RpdoValue.TORQUE_OFFSET,
    0x60FF: RpdoValue.VELOCITY,
    0x607A: RpdoValue.POSITION,
    0x60B1: RpdoValue.VELOCITY_OFFSET,
}
"""The value that the cycle writes to each CiA 402 object which an RPDO may map, by index."""
RETURN_OVERSHOOT = 0.5
"""Share of the following error limit that an axis may overshoot when it returns from beyond its position
limits; chosen."""
PDO_OBJECTS_MAX = 8
"""Bounds the objects of a PDO: 8 bytes, each object has at least one."""
SIGNED_OF_FORMAT = {"b": True, "h": True, "i": True, "B": False, "H": False, "I": False}
"""Whether an integer format is signed; `struct` formats of up to 32 bits."""
_NOT_MAPPED = InputPlace(0, 0, 0, signed=False)


class PdoTypeError(EdsError):
    """An object that the cycle needs is not an integer of 8, 16 or 32 bits."""


def axis_parts(
    config: AxisConfig,
    params: AxisParams,
    rpdos: Sequence[PdoCodec],
    tpdos: Mapping[int, PdoCodec],
    scale_tpdo: tuple[int, PdoCodec] | None,
) -> AxisParts:
    """Make the parameter records of an axis.

    `tpdos`: the drive's cyclic TPDOs by index among the inputs, the first one first, the further ones at
    consecutive indices; `scale_tpdo`: index and codec of the scale's TPDO.

    Raises:
        PdoTypeError: an object is not an integer.

    """
    scaling, period_s = drive_scaling(config), params.period_s
    drive, *further = tpdos
    return AxisParts(
        params=params,
        units=SetPointUnits(
            scaling.newton_per_permille,
            scaling.metre_per_count,
            scaling.metre_per_s_per_unit,
            # without an object of its own the offset is part of the force set point, as in the twin
            offset_apart=any(rpdo.position(TORQUE_OFFSET) is not None for rpdo in rpdos),
            velocity_offset=config.mode == "csp",
        ),
        limits=supervision_limits(config, scaling, period_s),
        route=drive_route(config, period_s),
        wiring=Wiring(
            drive=drive,
            further=min(further, default=0),
            further_count=len(further),
            scale=-1 if scale_tpdo is None else scale_tpdo[0],
            statusword=_input_place(tpdos, STATUSWORD),
            position=_input_place(tpdos, POSITION_ACTUAL_VALUE),
            current=_input_place(tpdos, CURRENT_ACTUAL_VALUE),
            mode_shown=_input_place(tpdos, MODE_DISPLAY),
            scale_position=_NOT_MAPPED
            if scale_tpdo is None
            else _input_place(dict([scale_tpdo]), POSITION_VALUE),
            metre_per_count=scaling.metre_per_count,
            ampere_per_permille=scaling.ampere_per_permille,
            newton_per_ampere=scaling.newton_per_ampere,
            scale_metre_per_count=scale_metre_per_count(config),
        ),
        bounds=axis_bounds(config, scaling, period_s),
    )


def drive_route(config: AxisConfig, period_s: float) -> Route:
    """Return the constants of the drive's sequence."""
    return Route(
        int(MODE_OF_NAME[config.mode]),
        config.homing_method != 0,
        period_s,
        mode_switch_disabled=config.drive.mode_switch == "disabled",
        homed_by_bit_12=config.drive.homing_bits == "12",
    )


def axis_bounds(config: AxisConfig, scaling: DriveScaling, period_s: float) -> AxisBounds:
    """Return the bounds of the position, and the largest movement in a cycle that counts as standstill."""
    lowest_mm, highest_mm = config.limits.position_mm
    margin_mm = config.limits.following_error_mm
    return AxisBounds(
        lowest_m=(lowest_mm - margin_mm) * 1e-3,
        highest_m=(highest_mm + margin_mm) * 1e-3,
        return_overshoot_m=RETURN_OVERSHOOT * margin_mm * 1e-3,
        standstill_step_m=COASTS_M_S * period_s + abs(scaling.metre_per_count),
    )


def output_places(rpdo: PdoCodec) -> Index:
    """Return `RpdoValue` and size in bytes of each object of an RPDO, (8, 2); size 0 after the last object.

    Raises:
        PdoTypeError: an object is not an integer.

    """
    places = np.zeros((PDO_OBJECTS_MAX, 2), np.int64)
    for place, mapped in zip(places, rpdo.objects, strict=False):
        _check_integer(mapped)
        place[:] = RPDO_VALUE_OF_INDEX[mapped.index], mapped.bits // 8
    return places


def _input_place(tpdos: Mapping[int, PdoCodec], address: tuple[int, int]) -> InputPlace:
    """Return where an object lies in the TPDOs; if several map it, in the last one."""
    mapped_at = _NOT_MAPPED
    for tpdo_index, tpdo in tpdos.items():
        start = 0
        for mapped in tpdo.objects:
            if mapped.address == address:
                _check_integer(mapped)
                mapped_at = InputPlace(tpdo_index, start, mapped.bits // 8, SIGNED_OF_FORMAT[mapped.format])
            start += mapped.bits // 8
    return mapped_at


def _check_integer(mapped: MappedObject) -> None:
    if mapped.format not in SIGNED_OF_FORMAT:
        raise PdoTypeError(f"{mapped.name} is not an integer of 8, 16 or 32 bits, which the cycle needs")
