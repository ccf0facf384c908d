"""`--map position=q_mm*1e-3,force=force_N`: the roles of columns, and their conversion to SI.

An entry is `[AXIS.]ROLE=COLUMN[*FACTOR]`. With a factor the product is SI; without one the unit is that of
the file, else the one at the end of the name, else SI. `force_per_volt` is a number or the name of one in the
file; `period` (s) is the sample time where that of the file is wrong or missing.
"""

import math
from collections.abc import Iterable
from typing import NamedTuple

from reconcile.errors import ReconcileError
from reconcile.formats.quantities import ROLES
from reconcile.formats.table import short_list

CONSTANTS = ("force_per_volt", "period")


class MapEntry(NamedTuple):
    """The role of one column; `axis` is empty where the recording has one axis without a name."""

    axis: str
    role: str
    column: str
    factor: float | None

    def __str__(self) -> str:
        name = f"{self.axis}.{self.role}" if self.axis else self.role
        return f"{name}={self.column}" + ("" if self.factor is None else f"*{self.factor:g}")


class Mapping(NamedTuple):
    """All entries of `--map`."""

    entries: tuple[MapEntry, ...] = ()
    force_per_volt: str = ""
    """A number, or the name of one in the file."""
    period_s: float | None = None


NO_MAPPING = Mapping()


def parse_mapping(texts: Iterable[str]) -> Mapping:
    """Parse the values of the option. Raises ReconcileError naming the entry."""
    entries: list[MapEntry] = []
    constants: dict[str, str] = {}
    for text in (part.strip() for argument in texts for part in argument.split(",")):
        target, equals, source = (part.strip() for part in text.partition("="))
        if not (target and equals and source):
            raise _wrong(text, "is not of the form ROLE=COLUMN")
        if target in CONSTANTS:
            constants[target] = source
            continue
        entry = _entry(text, target, source)
        if any((other.axis, other.role) == (entry.axis, entry.role) for other in entries):
            raise _wrong(text, f"{target} is given twice")
        entries.append(entry)
    period_s = None
    if "period" in constants:
        period_s = _number(f"period={constants['period']}", constants["period"])
        if period_s <= 0.0:
            raise _wrong(f"period={constants['period']}", "must be above zero")
    return Mapping(tuple(entries), constants.get("force_per_volt", ""), period_s)


def _entry(text: str, target: str, source: str) -> MapEntry:
    axis, _, role = target.rpartition(".")
    if role not in ROLES:
        raise _wrong(text, f"there is no {role!r}; there are: {short_list([*ROLES, *CONSTANTS], 20)}")
    column, star, factor = source.rpartition("*")
    if not star:
        return MapEntry(axis, role, source, None)
    if not column:
        raise _wrong(text, "the column's name is missing")
    return MapEntry(axis, role, column.strip(), _number(text, factor.strip()))


def _number(text: str, value: str) -> float:
    try:
        number = float(value)
    except ValueError:
        raise _wrong(text, f"{value!r} is not a number") from None
    if not math.isfinite(number) or number == 0.0:
        raise _wrong(text, f"{value} is not a usable number")
    return number


def _wrong(text: str, reason: str) -> ReconcileError:
    return ReconcileError("--map", text, reason)
