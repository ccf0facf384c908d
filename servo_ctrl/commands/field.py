"""The vocabulary in which a status field is declared.

`FIELDS_OF` has the fields of every status type, also of those in `servo_ctrl.learning`, which know nothing of
wires. What has no `Field` there is on the local socket only.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import Any, NamedTuple

AXES = 8
"""Axes that have objects; the dictionary of an EDS is fixed."""
NM, UM, DECIMICRON = 1e-9, 1e-6, 1e-7
US, UM_S2, NM_S = 1e-6, 1e-6, 1e-9
"""SI value of one count of an object."""


class DataType(IntEnum):
    """Data types of our objects by their code in CiA 301; TABLE is a DOMAIN of INTEGER32, row by row."""

    I8 = 0x02
    U8 = 0x05
    U16 = 0x06
    U32 = 0x07
    TEXT = 0x09
    TABLE = 0x0F

    @property
    def bits(self) -> int:
        """Length of a number; 0 where it varies."""
        return {"I8": 8, "U8": 8, "U16": 16, "U32": 32}.get(self.name, 0)


class PerAxis(Enum):
    """How an entry is repeated for each axis."""

    NONE = 0
    INDEX = 1
    """The declared index is that of axis 1."""
    SUBINDEX = 2
    """The subindex is the number of the axis."""


@dataclass(frozen=True, slots=True)
class Entry:
    """Where a value is in the object dictionary, and as what number."""

    index: int
    subindex: int
    data_type: DataType
    unit: float = 0.0
    """SI value of one count; 0 for what is no quantity."""
    axis: PerAxis = PerAxis.NONE
    names: tuple[str, ...] = ()
    """The number is the place of the text among these."""
    axis_number: bool = False
    """The number is that of the axis with this name, from 1."""
    columns: tuple[float, ...] = ()
    """Units of the columns of a table."""
    writable: bool = False
    low: int | None = None
    high: int | None = None
    """Bounds of what can be written."""
    default: int | None = None
    """Value in the EDS; None = `absent`."""
    none: int | None = None
    """Number where there is no value; None = all ones for a quantity or a name, else 0."""
    pdo: int = 0
    """Place in the status TPDO, from 1; 0 = not mapped."""

    def of_axis(self, number: int) -> tuple[int, int]:
        """Index and subindex of this axis, counted from 1."""
        if self.axis is PerAxis.INDEX:
            return self.index + number - 1, self.subindex
        return self.index, number if self.axis is PerAxis.SUBINDEX else self.subindex

    @property
    def absent(self) -> int:
        """The number where there is no value."""
        if self.none is not None:
            return self.none
        return (1 << self.data_type.bits) - 1 if self.unit or self.names else 0


class Field(NamedTuple):
    """One status field on every wire. Its key on the local socket is its name in the type."""

    title: str = ""
    """Name of its object."""
    entry: Entry | None = None
    meaning: str = ""
    mqtt: str | None = ""
    """Key over MQTT; "" = the field's name with the unit of the topic, None = not over MQTT."""
    local: bool = True
    """On the local socket."""
    part: str = ""
    """Property of the type without which there is no value: the key is left out over MQTT then."""
    presence: bool = False
    """Where this has no value, the whole record has none."""
    null: bool = False
    """An empty text is null over MQTT."""
    digits: int = 6
    """Decimals over MQTT."""
    columns: tuple[str, ...] = ()
    """Keys over MQTT of the columns of a table, whose values are in thousandths of the SI unit."""
    rows: "Field | None" = None
    """The number of rows of a table, a field of its own in the dictionary."""
    label: str = ""
    """Row of `servo-ctrl ask status`; "" = none."""
    text: Callable[[Any], str] = str
    """The value in that row."""


FIELDS_OF: dict[type, dict[str, Field]] = {}
"""Fields by the status types that have them; a name is a field or a property of the type."""


def topic_unit(name: str) -> tuple[str, float]:
    """The key of an SI quantity over MQTT and on the command line, and what its value is multiplied by."""
    for suffix, unit, factor in (("_m_s2", "_mm_s2", 1e3), ("_m_s", "_mm_s", 1e3), ("_m", "_um", 1e6)):
        if name.endswith(suffix):
            return name.removesuffix(suffix) + unit, factor
    return name, 1.0


def numbered(members: Iterable[IntEnum]) -> str:
    """The numbers of an enumeration in words, as "0 idle, 1 running"."""
    return ", ".join(f"{member.value} {member.name.lower().replace('_', ' ')}" for member in members)
