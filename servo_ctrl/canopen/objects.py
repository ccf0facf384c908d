"""Addresses and number formats of our own objects: one table for our node and for who asks it.

Axes are counted from 1 in the order of the machine file; 0 stands for all of them, or for none. Lengths
are whole nanometres. All ones in an unsigned number say that there is no value yet.
"""

from __future__ import annotations

import math
import struct

from servo_ctrl.canopen.scaling import to_integer

PRODUCT_CODE = (0x1018, 2)
STATE, LAST_ERROR, CYCLES, MISSED_TICKS, REASON = 0x2000, 0x2001, 0x2002, 0x2003, 0x2004
COMMAND, AXIS_SELECTION, COMPENSATION, OBSERVER, SETTINGS, REFUSAL, AXIS_COMMAND, SCREW = range(
    0x2100, 0x2108
)
LEARNING, LEARNING_STAGE, LEARNING_END, SUMMARY = range(0x2110, 0x2114)
MONITORING, RESULT, FUNCTIONS, SCREW_RESULT, SCREW_TABLE = 0x2120, 0x2130, 0x2140, 0x2150, 0x2160
"""Plus the number of the axis."""
STATUS_TPDO = 0x1800
AXES = 8
"""As many axes have objects."""

NM, UM, UM_S2, US, NM_S, DECIMICRON = 1e-9, 1e-6, 1e-6, 1e-6, 1e-9, 1e-7
NONE_8, NONE_16, NONE_32 = 0xFF, 0xFFFF, 0xFFFF_FFFF
DURATION_UNITS = (UM_S2, US)
AMPLITUDE_UNITS = (UM_S2, NM_S)
TRAILING_UNITS = (UM_S2, US, US, NM_S)
"""Units of a row of 2140h + n, subs 1, 2 and 3."""
SCREW_UNITS = (UM, NM, NM)
"""Of a row of 2160h + n."""
_INT32_MAX = 0x7FFF_FFFF


def whole(value: float | None, unit: float, none: int = NONE_32) -> int:
    """`value` in whole units, held below `none`, which says that there is no value."""
    if value is None or math.isnan(value):
        return none
    return to_integer(value, unit, 0, none - 1)


def value_of(number: int, unit: float, none: int = NONE_32) -> float:
    """The other way round; NaN where there is no value. One division: 3500 nm is 3.5e-6 to the last bit."""
    return math.nan if number == none else number / round(1.0 / unit)


def packed_rows(rows: tuple[tuple[float, ...], ...], units: tuple[float, ...]) -> bytes:
    """A learned function as INTEGER32 after INTEGER32, row by row."""
    numbers = [
        to_integer(value, unit, -_INT32_MAX, _INT32_MAX)
        for row in rows
        for value, unit in zip(row, units, strict=True)
    ]
    return struct.pack(f"<{len(numbers)}i", *numbers)


def unpacked_rows(data: bytes, units: tuple[float, ...]) -> tuple[tuple[float, ...], ...]:
    """The other way round. Raises struct.error for half a row."""
    rows = struct.iter_unpack(f"<{len(units)}i", data)
    return tuple(
        tuple(value_of(n, unit, 1 << 32) for n, unit in zip(row, units, strict=True)) for row in rows
    )
