"""Status of the axes as rows of a table for people, each a label and a cell for every axis."""

from collections.abc import Iterator, Sequence
from typing import Any

from servo_ctrl.commands.axis_status import AxisStatus
from servo_ctrl.commands.field import FIELDS_OF
from servo_ctrl.commands.local_codec import record_type, type_hints


def axis_rows(axes: Sequence[AxisStatus]) -> Iterator[tuple[str, list[str]]]:
    """The labelled fields of an axis in the order of their declaration; "" where there is no value."""
    return _rows(AxisStatus, axes)


def _rows(kind: Any, values: Sequence[Any]) -> Iterator[tuple[str, list[str]]]:
    hints = type_hints(kind)
    for name, field in FIELDS_OF[kind].items():
        record = record_type(hints.get(name))
        found = [_present(value, name, field.part) for value in values]
        if record is not None:
            yield from _rows(record, found)
        elif field.label:
            yield field.label, ["" if value is None else field.text(value) for value in found]


def _present(value: Any, name: str, part: str) -> Any:
    """A field of a record; None where the record, or the part of it, is not there."""
    if value is None or (part and not getattr(value, part)):
        return None
    return getattr(value, name)
