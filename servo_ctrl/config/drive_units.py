"""Units of a drive's velocities and accelerations: names in the machine file, and codes in 60A9h and 60AAh.

The code is prefix << 24 | numerator << 16 | denominator << 8 (CiA 303-2), with a power of ten as prefix.
Other units, such as 16.16 fixed point, have no code.
"""

import math
import re
from collections.abc import Callable
from typing import NamedTuple

_UNIT = re.compile(r"(?:(\d+(?:\.\d+)?(?:e-?\d+)?) )?(counts/s2?|rpm(?:/s)?|rev/s2?)")


class _BaseUnit(NamedTuple):
    """A unit without a multiple: its kind, its size in counts or revolutions, its code."""

    kind: str
    per_revolution: bool
    size: float
    code: int | None


_BASE_UNITS = {
    "counts/s": _BaseUnit("/s", per_revolution=False, size=1.0, code=0x00B5_0300),
    "rpm": _BaseUnit("/s", per_revolution=True, size=1.0 / 60.0, code=0x00B4_4700),
    "rev/s": _BaseUnit("/s", per_revolution=True, size=1.0, code=0x00B4_0300),
    "counts/s2": _BaseUnit("/s2", per_revolution=False, size=1.0, code=None),
    "rpm/s": _BaseUnit("/s2", per_revolution=True, size=1.0 / 60.0, code=0x00C0_0300),
    "rev/s2": _BaseUnit("/s2", per_revolution=True, size=1.0, code=None),
}
"""Codes as in drives (maxon: rpm and rpm/s; Nanotec: counts/s); None: the drive's code is not checked."""


class DriveUnit(NamedTuple):
    """A unit of velocity or acceleration."""

    counts: float
    """The unit in counts/s or counts/s^2."""
    code: int | None
    """Expected value of 60A9h or 60AAh; None if it is not checked."""


def drive_unit(text: str, counts_per_rev: int) -> DriveUnit:
    """Return the unit with this name in the machine file. Raises ValueError."""
    match = _UNIT.fullmatch(text)
    multiple = float(match[1] or 1.0) if match else 0.0
    if match is None or not 0.0 < multiple < math.inf:
        raise ValueError(f'"{text}" is not a unit; "rpm" is one, and "0.1 counts/s"')
    base = _BASE_UNITS[match[2]]
    counts = multiple * base.size * (counts_per_rev if base.per_revolution else 1.0)
    exponent = round(math.log10(multiple))
    if base.code is None or not math.isclose(10.0**exponent, multiple, rel_tol=1e-12):
        return DriveUnit(counts, None)
    return DriveUnit(counts, (exponent & 0xFF) << 24 | base.code)


def unit_validator(kind: str) -> Callable[[str], str]:
    """Return a validator of units of this kind: "/s" for velocities, "/s2" for accelerations."""

    def check(text: str) -> str:
        drive_unit(text, 1)
        match = _UNIT.fullmatch(text)
        if match is None or _BASE_UNITS[match[2]].kind != kind:
            known = ", ".join(name for name, base in _BASE_UNITS.items() if base.kind == kind)
            raise ValueError(f'"{text}" is none of {known}')
        return text

    return check
