"""Converts object values between SDO bytes and values of the page, by the data type in the EDS."""

import math
import struct

from servo_ctrl.canopen.pdo import STRUCT_FORMATS
from servo_ctrl.canopen.stack import EdsVariable

WRITE_BYTES_MAX = 1000
"""Bounds the bytes of one write; chosen."""
BOOLEAN, VISIBLE_STRING = 0x01, 0x09


def decoded(variable: EdsVariable, data: bytes) -> int | float | str:
    """Decode a number or text; return bytes in hex for other types or a wrong length."""
    layout = _layout(variable)
    if layout and len(data) == struct.calcsize(layout):
        number: int | float = struct.unpack(layout, data)[0]
        return number if math.isfinite(number) else str(number)
    if variable.data_type == VISIBLE_STRING:
        return data.rstrip(b"\0").decode("ascii", "replace")
    return data.hex()


def encoded(variable: EdsVariable, value: float | str | bool) -> bytes:
    """Encode a value. Raises ValueError with a reason if the object cannot hold it."""
    layout = _layout(variable)
    if layout:
        return _number(variable, layout, value)
    text = variable.data_type == VISIBLE_STRING
    try:
        data = str(value).encode("ascii") if text else bytes.fromhex(str(value))
    except ValueError:
        raise ValueError("enter ASCII text" if text else "enter bytes in hexadecimal") from None
    if not 0 < len(data) <= WRITE_BYTES_MAX:
        raise ValueError(f"enter 1 to {WRITE_BYTES_MAX} bytes")
    return data


def _number(variable: EdsVariable, layout: str, value: float | str | bool) -> bytes:
    real = layout[-1] in "fd"
    if isinstance(value, str):
        raise ValueError("enter a number")  # noqa: TRY004  # it is the user's mistake, not the caller's
    if not real and not float(value).is_integer():
        raise ValueError("enter a whole number")
    low, high = variable.low, variable.high
    if (low is not None and value < low) or (high is not None and value > high):
        raise ValueError(f"{value:g} is not within {low} to {high}")
    try:
        return struct.pack(layout, value if real else int(value))
    except (struct.error, OverflowError):
        raise ValueError(f"{value:g} does not fit") from None


def _layout(variable: EdsVariable) -> str:
    """Return the `struct` format of a number; "" for other types."""
    layout = "B" if variable.data_type == BOOLEAN else STRUCT_FORMATS.get(variable.data_type)
    return "" if layout is None else "<" + layout
