"""Codec of status fields as numbers, texts and tables of our objects; see `servo_ctrl.commands.field`.

`DataType.unknown` means that there is no value.
"""

import math
import struct
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

from servo_ctrl.canopen.dictionary import Value
from servo_ctrl.canopen.scaling import to_integer
from servo_ctrl.commands.field import FIELDS_OF, DataType, Entry
from servo_ctrl.commands.local_codec import record_type, type_hints
from servo_ctrl.commands.status_fields import StatusField, status_fields

_INT32_MAX = 0x7FFF_FFFF


class ObjectField(NamedTuple):
    """A status field that has an object."""

    status_field: StatusField
    entry: Entry

    def of(self, status: Any, axes: Sequence[str]) -> Value:
        """Value of the object; `axes`: axis names, numbered from 1."""
        return encoded(self.status_field.of(status), self.entry, axes)


@cache
def object_fields(kind: Any) -> tuple[ObjectField, ...]:
    """Fields of a status type that have objects, in the order of declaration."""
    return tuple(
        ObjectField(status_field, entry)
        for status_field in status_fields(kind)
        if (entry := status_field.field.entry) is not None
    )


def encoded(value: Any, entry: Entry, axes: Sequence[str] = ()) -> Value:
    """Encode a value for its object; None: there is no value."""
    if entry.data_type is DataType.TEXT:
        return value or ""
    if entry.data_type is DataType.TABLE:
        return packed_rows(value or (), entry.columns)
    if entry.axis_number:
        return axes.index(value) + 1 if value in axes else 0
    if value is None:
        return entry.absent
    return _number(value, entry)


def _number(value: Any, entry: Entry) -> int:
    if entry.names:
        return entry.names.index(value) if value in entry.names else entry.absent
    if entry.unit and math.isnan(value):
        return entry.absent
    if entry.data_type is DataType.I32:
        return to_integer(value, entry.unit, -_INT32_MAX, _INT32_MAX)
    highest = (1 << entry.data_type.bits) - 1
    if entry.unit:
        return to_integer(value, entry.unit, 0, highest - 1)
    if entry.data_type is DataType.U16:
        return min(int(value), highest)
    return int(value) & highest if entry.data_type is DataType.U32 else int(value)


def decoded(value: Value, entry: Entry, hint: Any, axes: Sequence[str] = ()) -> Any:
    """Decode the value of an object for a field of type `hint`; None if there is no value."""
    if isinstance(value, str):
        return value
    if isinstance(value, bytes):
        return unpacked_rows(value, entry.columns)
    if entry.axis_number:
        return axes[value - 1] if value else ""
    if entry.names:
        return entry.names[value] if value < len(entry.names) else None
    if entry.unit:
        return math.nan if value == entry.data_type.unknown else to_si(value, entry.unit)
    return hint(value)


def to_si(number: int, unit: float) -> float:
    """Convert counts to SI, by one division: 3500 nm is 3.5e-6 to the last bit."""
    return number / round(1.0 / unit)


def packed_rows(rows: tuple[tuple[float, ...], ...], units: tuple[float, ...]) -> bytes:
    """Encode a table as INTEGER32 values, row by row."""
    numbers = [
        to_integer(value, unit, -_INT32_MAX, _INT32_MAX)
        for row in rows
        for value, unit in zip(row, units, strict=True)
    ]
    return struct.pack(f"<{len(numbers)}i", *numbers)


def unpacked_rows(data: bytes, units: tuple[float, ...]) -> tuple[tuple[float, ...], ...]:
    """Decode a table. Raises struct.error for an incomplete row."""
    rows = struct.iter_unpack(f"<{len(units)}i", data)
    return tuple(tuple(to_si(n, unit) for n, unit in zip(row, units, strict=True)) for row in rows)


def build_record(kind: Any, values: Mapping[tuple[str, ...], Any], given: Mapping[str, Any]) -> Any:
    """Build a status record from values by path; `given`: fields without an object.

    None if the field that marks the presence of the record has no value.
    """
    fields, hints = FIELDS_OF[kind], type_hints(kind)
    if any(field.presence and not values[name,] for name, field in fields.items()):
        return None
    fields_by_name = dict(given)
    for name in kind._fields:
        record = record_type(hints[name])
        if record is not None and name in fields:
            inner = {path[1:]: value for path, value in values.items() if path[0] == name and len(path) > 1}
            fields_by_name[name] = build_record(record, inner, {})
        elif (name,) in values:
            fields_by_name[name] = values[name,]
    result = kind(**fields_by_name)
    absent = {n for n, f in fields.items() if f.part and not getattr(result, f.part) and n in fields_by_name}
    return result._replace(**{name: kind._field_defaults[name] for name in absent})
