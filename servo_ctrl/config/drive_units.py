"""Units of a drive's velocities and accelerations: names in the machine file, and codes in 60A9h and 60AAh.

The code is prefix << 24 | numerator << 16 | denominator << 8 (CiA 303-2), with a power of ten as prefix.
Other units, such as 16.16 fixed point, have no code.
"""

import math
import re
from collections.abc import Callable
from typing import NamedTuple

_UNIT = re.compile(r"(?:(\d+(?:\.\d+)?(?:e-?\d+)?) )?(counts/s2?|rpm(?:/s)?|rev/s2?)")


class _Base(NamedTuple):
    """A unit without multiple: its kind, its size in counts or revolutions per second, its code."""

    kind: str
    of_revolutions: bool
    size: float
    code: int | None


_BASES = {
    "counts/s": _Base("/s", of_revolutions=False, size=1.0, code=0x00B5_0300),
    "rpm": _Base("/s", of_revolutions=True, size=1.0 / 60.0, code=0x00B4_4700),
    "rev/s": _Base("/s", of_revolutions=True, size=1.0, code=0x00B4_0300),
    "counts/s2": _Base("/s2", of_revolutions=False, size=1.0, code=None),
    "rpm/s": _Base("/s2", of_revolutions=True, size=1.0 / 60.0, code=0x00C0_0300),
    "rev/s2": _Base("/s2", of_revolutions=True, size=1.0, code=None),
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
    found = _UNIT.fullmatch(text)
    multiple = float(found[1] or 1.0) if found else 0.0
    if found is None or not 0.0 < multiple < math.inf:
        raise ValueError(f'"{text}" is no unit; "rpm" is one, and "0.1 counts/s"')
    base = _BASES[found[2]]
    counts = multiple * base.size * (counts_per_rev if base.of_revolutions else 1.0)
    exponent = round(math.log10(multiple))
    if base.code is None or not math.isclose(10.0**exponent, multiple, rel_tol=1e-12):
        return DriveUnit(counts, None)
    return DriveUnit(counts, (exponent & 0xFF) << 24 | base.code)


def checked_unit(kind: str) -> Callable[[str], str]:
    """Return a validator of units of this kind: "/s" for velocities, "/s2" for accelerations."""

    def check(text: str) -> str:
        drive_unit(text, 1)
        found = _UNIT.fullmatch(text)
        if found is None or _BASES[found[2]].kind != kind:
            known = ", ".join(name for name, base in _BASES.items() if base.kind == kind)
            raise ValueError(f'"{text}" is none of {known}')
        return text

    return check
