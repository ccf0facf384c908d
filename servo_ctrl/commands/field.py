"""The types with which status fields are declared.

`FIELDS_OF` holds the fields of every status type, also of the types in `servo_ctrl.learning`, which contain
no encoding. A value without a `Field` there is on the local socket only.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import Any, NamedTuple

AXES = 8
"""Number of axes with objects, fixed because an EDS is."""
NM, UM, DECIMICRON = 1e-9, 1e-6, 1e-7
US, UM_S2, NM_S = 1e-6, 1e-6, 1e-9
"""SI values of one count of an object."""


class DataType(IntEnum):
    """Data types of the controller's objects by their CiA 301 code; TABLE is a DOMAIN of INTEGER32 rows."""

    I8 = 0x02
    I32 = 0x04
    U8 = 0x05
    U16 = 0x06
    U32 = 0x07
    TEXT = 0x09
    TABLE = 0x0F

    @property
    def bits(self) -> int:
        """Length of a number; 0 for a variable length."""
        return {"I8": 8, "I32": 32, "U8": 8, "U16": 16, "U32": 32}.get(self.name, 0)

    @property
    def unknown(self) -> int:
        """The number that no quantity has: all ones if unsigned, the least if signed."""
        return -1 << (self.bits - 1) if self.name.startswith("I") else (1 << self.bits) - 1


class PerAxis(Enum):
    """How an entry repeats for each axis."""

    NONE = 0
    INDEX = 1
    """The declared index is that of axis 1."""
    SUBINDEX = 2
    """The subindex is the number of the axis."""


@dataclass(frozen=True, slots=True)
class Entry:
    """The place of a value in the object dictionary, and its encoding as a number."""

    index: int
    subindex: int
    data_type: DataType
    unit: float = 0.0
    """SI value of one count; 0 if the value is not a quantity."""
    axis: PerAxis = PerAxis.NONE
    names: tuple[str, ...] = ()
    """Texts of an enumeration; the number is the index."""
    axis_number: bool = False
    """The value is the name of an axis, the number that axis, from 1."""
    columns: tuple[float, ...] = ()
    """Units of the columns of a table."""
    writable: bool = False
    low: int | None = None
    high: int | None = None
    """Bounds of a written number."""
    default: int | None = None
    """Value in the EDS; None = `absent`."""
    none: int | None = None
    """Number that stands for no value; None = `DataType.unknown` for a quantity or a name, else 0."""
    pdo: int = 0
    """Place in the status TPDO, from 1; 0 = not mapped."""

    def of_axis(self, number: int) -> tuple[int, int]:
        """Return index and subindex for the axis `number`, from 1."""
        if self.axis is PerAxis.INDEX:
            return self.index + number - 1, self.subindex
        return self.index, number if self.axis is PerAxis.SUBINDEX else self.subindex

    @property
    def absent(self) -> int:
        """The number that stands for no value."""
        if self.none is not None:
            return self.none
        return self.data_type.unknown if self.unit or self.names else 0


class Field(NamedTuple):
    """One status field in every encoding. Its key on the local socket is its name in the type."""

    title: str = ""
    """Name of its CANopen object."""
    entry: Entry | None = None
    meaning: str = ""
    mqtt: str | None = ""
    """Key over MQTT; "" = the field's name with the unit of the topic, None = not over MQTT."""
    local: bool = True
    """Whether it is on the local socket."""
    part: str = ""
    """Property of the type that must be true for the field to exist; else MQTT omits the key."""
    presence: bool = False
    """If this field has no value, the whole record has none."""
    null: bool = False
    """Whether an empty text is null over MQTT."""
    digits: int = 6
    """Decimals over MQTT."""
    columns: tuple[str, ...] = ()
    """MQTT keys of the columns of a table; the values are in thousandths of the SI unit."""
    rows: "Field | None" = None
    """The number of rows of a table, a separate object."""
    label: str = ""
    """Its row in `servo-ctrl ask status`; "" = none."""
    text: Callable[[Any], str] = str
    """Formats the value for that row."""


FIELDS_OF: dict[type, dict[str, Field]] = {}
"""Fields by status type; a name is a field or a property of the type."""


def topic_unit(name: str) -> tuple[str, float]:
    """Return the key of an SI quantity over MQTT and on the command line, and the factor of its value."""
    for suffix, unit, factor in (("_m_s2", "_mm_s2", 1e3), ("_m_s", "_mm_s", 1e3), ("_m", "_um", 1e6)):
        if name.endswith(suffix):
            return name.removesuffix(suffix) + unit, factor
    return name, 1.0


def numbered(members: Iterable[IntEnum]) -> str:
    """Return the members of an enumeration as a text like "0 idle, 1 running"."""
    return ", ".join(f"{member.value} {member.name.lower().replace('_', ' ')}" for member in members)
