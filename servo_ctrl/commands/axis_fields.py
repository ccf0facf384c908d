"""Builders of the fields of one axis; the declared objects are those of axis 1."""

from servo_ctrl.commands import texts
from servo_ctrl.commands.field import NM, DataType, Entry, Field, PerAxis


def number(title: str, index: int, subindex: int, bits: int = 16, meaning: str = "") -> Field:
    """Declare a count of `bits` bits."""
    return Field(title, Entry(index, subindex, DataType[f"U{bits}"], axis=PerAxis.INDEX), meaning)


def quantity(title: str, index: int, subindex: int, unit: float, none: int | None = None) -> Field:
    """Declare a quantity with `unit` as the SI value of one count."""
    return Field(title, Entry(index, subindex, DataType.U32, unit, axis=PerAxis.INDEX, none=none))


def length(title: str, index: int, subindex: int, label: str, meaning: str = "") -> Field:
    """Declare a length: nanometres by SDO, micrometres in text."""
    field = quantity(title, index, subindex, NM)
    return field._replace(meaning=meaning, label=label, text=texts.micrometres)


def switch(title: str, index: int, meaning: str, label: str) -> Field:
    """Declare a switch, a subindex for each axis."""
    entry = Entry(index, 0, DataType.U8, axis=PerAxis.SUBINDEX, writable=True, low=0, high=1)
    return Field(title, entry, meaning, label=label, text=texts.on_off)


def version(index: int, whose: str, label: str) -> Field:
    """Declare the version of a learned result."""
    field = number("Version", index, 1, meaning=f"Of the {whose} in use by axis 1 ... 8, 0 = none.")
    return field._replace(label=label, text=texts.version)


def date(index: int) -> Field:
    """Declare the date of a learned result."""
    return Field("Date", Entry(index, 2, DataType.TEXT, axis=PerAxis.INDEX), "ISO 8601.", null=True)


def table(
    title: str, index: int, subindex: int, meaning: str, columns: dict[str, float], rows: Field
) -> Field:
    """Declare a table with its columns, units by name, and the field of its number of rows."""
    entry = Entry(index, subindex, DataType.TABLE, axis=PerAxis.INDEX, columns=tuple(columns.values()))
    return Field(title, entry, meaning, columns=tuple(columns), rows=rows)
