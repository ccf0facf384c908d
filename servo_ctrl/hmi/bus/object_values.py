"""Values of a node's objects: parses what was typed, and turns values into requests and into text."""

import math
import re
import struct
from contextlib import suppress

from servo_ctrl.hmi.bus.object_tree import BYTES, INTEGERS, REALS, TEXTS, ObjectEntry

Value = int | float | str

BOOLEAN, VISIBLE_STRING, UNICODE_STRING = 0x1, 0x9, 0xB
"""Codes of data types (CiA 301, table 44)."""
MAX_LENGTH = 1000
"""Bounds the characters or bytes of one write; chosen: in hexadecimal they fit into a request."""


def parse_value(entry: ObjectEntry, text: str) -> Value:
    """Return the value of what was typed; bytes stay text in hex. Raises ValueError with the reason."""
    if not entry.writable:
        raise ValueError(f"{entry.address} is {entry.access}: it cannot be written")
    given, limits = text.strip(), entry.limits
    if limits is not None:
        return _integer(given, entry.type_name, *limits)
    if entry.type_code in REALS:
        return _real(given, entry.type_name)
    if entry.type_code in TEXTS:
        return _text(text, ascii_only=entry.type_code == VISIBLE_STRING)
    digits = re.sub(r"[\s:,]", "", given)
    if re.fullmatch(r"([0-9A-Fa-f]{2})+", digits) is None:
        raise ValueError(f"{entry.type_name}: enter bytes in hex, two digits each, like 01 A0 FF")
    if len(digits) > 2 * MAX_LENGTH:
        raise ValueError(f"at most {MAX_LENGTH} bytes can be written here")
    return digits.lower()


def value_text(entry: ObjectEntry, value: Value | None) -> str:
    """Return a value that was read as text: integers in decimal and hexadecimal, bytes in pairs."""
    if value is None:
        return "-"
    if entry.type_code in INTEGERS:
        number = _as_integer(entry, value)
        if isinstance(number, int) and entry.type_code != BOOLEAN:
            bits = INTEGERS[entry.type_code].bits
            return f"{number} ({number % (1 << bits):0{bits // 4}X}h)"
        return str(number)
    if entry.type_code in BYTES and isinstance(value, str):
        return " ".join(re.findall("..?", value.upper())) or "(empty)"
    return str(value)


def request_value(entry: ObjectEntry, value: Value) -> Value:
    """Return a parsed value as a request holds it: numbers and text unchanged, the rest as bytes in hex.

    The controller packs integers of 8, 16, 32 and 64 bits; others go as bytes, the least significant first.
    """
    integer = INTEGERS.get(entry.type_code)
    if integer is not None and integer.bits not in {8, 16, 32, 64}:
        return int(value).to_bytes(integer.bits // 8, "little", signed=integer.least < 0).hex()
    if entry.type_code == UNICODE_STRING:
        return str(value).encode("utf-16-le").hex()
    return value


def _integer(given: str, type_name: str, low: int, high: int) -> int:
    """Parse an integer in decimal, or hexadecimal as 0x2A or 2Ah. Raises ValueError."""
    text = f"0x{given[:-1]}" if re.fullmatch(r"[0-9A-Fa-f]+[hH]", given) else given
    try:
        value = int(text, 0)
    except ValueError:
        raise ValueError(f"{type_name}: enter a whole number, like 42, 0x2A or 2Ah") from None
    if not low <= value <= high:
        raise ValueError(f"{value} is outside {low} ... {high}")
    return value


def _real(given: str, type_name: str) -> float:
    try:
        value = float(given)
    except ValueError:
        raise ValueError(f"{type_name}: enter a number, like 0.25") from None
    if not math.isfinite(value):
        raise ValueError(f"{type_name}: infinities and NaN are not written")
    if type_name == "REAL32":
        try:
            struct.pack("<f", value)
        except OverflowError:
            raise ValueError(f"{value:g} is beyond REAL32") from None
    return value


def _text(text: str, *, ascii_only: bool) -> str:
    if len(text) > MAX_LENGTH:
        raise ValueError(f"at most {MAX_LENGTH} characters can be written here")
    if ascii_only and not (text.isascii() and text.isprintable()):
        raise ValueError("VISIBLE_STRING: only printable ASCII characters")
    return text


def _as_integer(entry: ObjectEntry, value: Value) -> Value:
    """Return an integer; bytes in hex if the controller does not unpack its length; others unchanged."""
    if isinstance(value, float) and value.is_integer():
        return int(value)
    if isinstance(value, str):
        integer = INTEGERS[entry.type_code]
        with suppress(ValueError):
            data = bytes.fromhex(value)
            if len(data) == integer.bits // 8:
                return int.from_bytes(data, "little", signed=integer.least < 0)
    return value
