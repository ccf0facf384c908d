"""Units of a drive's velocities and accelerations: as the machine file names them, and as 60A9h and 60AAh do.

A unit is coded as prefix << 24 | numerator << 16 | denominator << 8 (CiA 303-2), the prefix a power of ten.
What that cannot say, such as 16.16 fixed point, has no code.
"""

import math
import re
from collections.abc import Callable
from typing import NamedTuple

_UNIT = re.compile(r"(?:(\d+(?:\.\d+)?(?:e-?\d+)?) )?(counts/s2?|rpm(?:/s)?|rev/s2?)")


class _Base(NamedTuple):
    """A unit without a multiple: its kind, its size in counts or revolutions a second, its code."""

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
"""Codes as drives have them (maxon: rpm and rpm/s; Nanotec: counts/s); None: not held against any."""


class DriveUnit(NamedTuple):
    """A unit of velocity or acceleration."""

    counts: float
    """What one of it is in counts/s or counts/s^2."""
    code: int | None
    """60A9h or 60AAh, None where there is none to hold it against."""


def drive_unit(text: str, counts_per_rev: int) -> DriveUnit:
    """The unit that the machine file names. Raises ValueError."""
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
    """A validator of units of this kind: "/s" of velocities, "/s2" of accelerations."""

    def check(text: str) -> str:
        drive_unit(text, 1)
        found = _UNIT.fullmatch(text)
        if found is None or _BASES[found[2]].kind != kind:
            known = ", ".join(name for name, base in _BASES.items() if base.kind == kind)
            raise ValueError(f'"{text}" is none of {known}')
        return text

    return check
