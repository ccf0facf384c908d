"""Inputs of an axis: its drive's TPDO and its scale's, from device units to SI."""

import math
from collections.abc import Sequence
from itertools import chain

from servo_ctrl.canopen.cia402 import DriveState, drive_state
from servo_ctrl.canopen.pdo import PdoCodec
from servo_ctrl.canopen.scaling import drive_scaling, scale_metre_per_count
from servo_ctrl.config.model import AxisConfig

STATUSWORD, POSITION_ACTUAL_VALUE, CURRENT_ACTUAL_VALUE = (0x6041, 0), (0x6064, 0), (0x6078, 0)
MODE_DISPLAY = (0x6061, 0)
"""Objects of CiA 402."""
POSITION_VALUE = (0x6004, 0)
"""Of a scale, CiA 406."""


class AxisInputs:
    """The inputs of the last cycle. Positions in metres at the table, relative to home."""

    def __init__(self, config: AxisConfig, tpdos: Sequence[PdoCodec], scale_tpdo: PdoCodec | None) -> None:
        """`tpdos`: those of the drive that come with every SYNC, whose values `take` is given in a row."""
        self.statusword = 0
        """Of the drive, as it came last."""
        self.counts = 0
        """Position of the drive in its own unit, as it came last."""
        self.motor_m = self.previous_motor_m = self.scale_m = self.current_a = math.nan
        """NaN when they did not come."""
        self.unit = drive_scaling(config)
        self._scale_unit_m = scale_metre_per_count(config)
        self._scale_raw_m = self._scale_offset_m = math.nan
        self.mode_shown: int | None = None
        """Mode of operation that the drive is in (6061h), None where it does not tell."""
        places = _places(tpdos)
        self._status_at = places.get(STATUSWORD)  # else `take_event` is given it
        self._position_at = places[POSITION_ACTUAL_VALUE]  # the configuration has checked that it is mapped
        self._current_at = places.get(CURRENT_ACTUAL_VALUE)
        self._mode_at = places.get(MODE_DISPLAY)
        self._current_held_a = math.nan
        self._scale_at = None if scale_tpdo is None else _places([scale_tpdo])[POSITION_VALUE]

    @property
    def drive_state(self) -> DriveState:
        """Of the power stage, as it came last."""
        return drive_state(self.statusword)

    def take(self, drive: tuple[int, ...] | None, scale: tuple[int, ...] | None) -> bool:
        """Decode the values of this cycle, None = missing; True when all of them have come."""
        self.previous_motor_m = self.motor_m
        if drive is None:
            self.motor_m = self.current_a = math.nan
        else:
            if self._status_at is not None:
                self.statusword = drive[self._status_at]
            self.counts = drive[self._position_at]
            self.motor_m = self.counts * self.unit.metre_per_count
            if self._current_at is not None:
                self.current_a = drive[self._current_at] * self.unit.ampere_per_permille
            else:
                self.current_a = self._current_held_a
            if self._mode_at is not None:
                self.mode_shown = drive[self._mode_at]
        if scale is None or self._scale_at is None:
            self._scale_raw_m = self.scale_m = math.nan
        else:
            self._scale_raw_m = scale[self._scale_at] * self._scale_unit_m
            self.scale_m = self._scale_raw_m + self._scale_offset_m
        return drive is not None and (scale is not None or self._scale_at is None)

    def take_event(self, codec: PdoCodec, values: Sequence[int]) -> None:
        """Take a TPDO of the drive that comes at a change: its values hold until the next one."""
        for mapped, value in zip(codec.objects, values, strict=True):
            if mapped.address == STATUSWORD:
                self.statusword = value
            elif mapped.address == MODE_DISPLAY:
                self.mode_shown = value
            elif mapped.address == CURRENT_ACTUAL_VALUE:
                self._current_held_a = value * self.unit.ampere_per_permille

    def align_scale(self) -> None:
        """Set the offset with which the scale reads here what the motor encoder reads."""
        self._scale_offset_m = self.motor_m - self._scale_raw_m
        self.scale_m = self.motor_m


def _places(codecs: Sequence[PdoCodec]) -> dict[tuple[int, int], int]:
    """Map index and subindex of each mapped object to its place among the values."""
    objects = chain.from_iterable(codec.objects for codec in codecs)
    return {mapped.address: place for place, mapped in enumerate(objects)}
