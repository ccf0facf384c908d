"""Lists every field of a status type and of the records in it, with the path to its value."""

from collections.abc import Iterator, Sequence
from functools import cache
from typing import Any, NamedTuple

from servo_ctrl.commands.axis_status import AxisStatus
from servo_ctrl.commands.field import FIELDS_OF, Field
from servo_ctrl.commands.local_codec import record_type, type_hints


class StatusField(NamedTuple):
    """A declared field and its place in the status."""

    path: tuple[str, ...]
    field: Field
    hint: Any
    """Type of its value; None for a derived field, a property."""
    rows: bool = False
    """Whether the field is the number of rows of the table at `path`."""

    def of(self, status: Any) -> Any:
        """Return its value; None if a record on its path is missing."""
        value = self._at(status, self.path)
        return len(value or ()) if self.rows else value

    def text_of(self, status: Any) -> str:
        """Return its value as text; "" if the value or its `Field.part` is missing."""
        *place, _ = self.path
        absent = self.field.part and not self._at(status, (*place, self.field.part))
        value = None if absent else self._at(status, self.path)
        return "" if value is None else self.field.text(value)

    @staticmethod
    def _at(status: Any, path: Sequence[str]) -> Any:
        for name in path:
            status = None if status is None else getattr(status, name)
        return status


@cache
def status_fields(kind: Any) -> tuple[StatusField, ...]:
    """Return the fields of a status type and of the records in it, in the order of declaration."""
    hints, found = type_hints(kind), []
    for name, field in FIELDS_OF[kind].items():
        record = record_type(hints.get(name))
        if record is None:
            found.append(StatusField((name,), field, hints.get(name)))
        else:
            found += [inner._replace(path=(name, *inner.path)) for inner in status_fields(record)]
        if field.rows is not None:
            found.append(StatusField((name,), field.rows, int, rows=True))
    return tuple(found)


def axis_rows(axes: Sequence[AxisStatus]) -> Iterator[tuple[str, list[str]]]:
    """Yield the label of each labelled axis field, in declared order, and its text for every axis."""
    for found in status_fields(AxisStatus):
        if found.field.label:
            yield found.field.label, [found.text_of(axis) for axis in axes]
