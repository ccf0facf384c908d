"""Walks a status type and the records in it: every field, with the path that leads to its value."""

from functools import cache
from typing import Any, NamedTuple

from servo_ctrl.commands.field import FIELDS_OF, Field
from servo_ctrl.commands.local_codec import record_type, type_hints


class StatusField(NamedTuple):
    """A declared field and where it is in the status."""

    path: tuple[str, ...]
    field: Field
    hint: Any
    """Its type; None for a derived field, a property."""
    rows: bool = False
    """The field is the number of rows of the table at `path`."""

    def of(self, status: Any) -> Any:
        """Its value; None where a record on its path is not there."""
        for name in self.path:
            if status is not None:
                status = getattr(status, name)
        if self.rows:
            return 0 if status is None else len(status)
        return status


@cache
def status_fields(kind: Any) -> tuple[StatusField, ...]:
    """The fields of a status type and of the records in it, in the order of declaration."""
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
