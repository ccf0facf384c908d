"""Display units: values are SI inside and shown in one of three unit systems."""

import math
from typing import NamedTuple

NO_VALUE = "\N{EM DASH}"
"""Shown where there is no value."""
MINUS = "\N{MINUS SIGN}"
INCH_M = 0.0254
"""Length of an inch, metres; by definition."""


def grouped(number: float, decimals: int = 0, *, sign: bool = False) -> str:
    """Return the number with thin spaces between thousands and a true minus sign."""
    text = f"{number:{'+' if sign else ''},.{decimals}f}"
    return text.replace(",", "\N{THIN SPACE}").replace("-", MINUS)


def duration_text(seconds: float) -> str:
    """Return `1 h 05 min`, `4 min 10 s`, `8 s`; "" without a value."""
    if not math.isfinite(seconds):
        return ""
    whole = round(seconds)
    if whole >= 3600:
        return f"{whole // 3600} h {whole % 3600 // 60:02d} min"
    return f"{whole // 60} min {whole % 60:02d} s" if whole >= 60 else f"{whole} s"


class DisplayUnit(NamedTuple):
    """One quantity in one unit system: shown value = SI value times `factor`, with this many decimals."""

    unit: str
    factor: float
    decimals: int

    def text(self, value: float | None, *, sign: bool = False) -> str:
        """Return the number without its unit; a dash where there is none."""
        if value is None or not math.isfinite(value):
            return NO_VALUE
        # adding 0.0 turns -0.0 into 0.0: what rounds to zero is shown without a minus sign
        return grouped(round(value * self.factor, self.decimals) + 0.0, self.decimals, sign=sign)

    def with_unit(self, value: float | None, *, sign: bool = False) -> str:
        """Number and unit; a dash alone where there is none."""
        text = self.text(value, sign=sign)
        return text if text == NO_VALUE else f"{text} {self.unit}"


class UnitSystem(NamedTuple):
    """The display units of all quantities that the pages show."""

    name: str
    label: str
    length: DisplayUnit
    """Positions and travels, from metres."""
    error: DisplayUnit
    """Deviations, some thousand times smaller than travels, from metres."""
    velocity: DisplayUnit
    """From m/s."""
    feed: DisplayUnit
    """The same per minute, as part programs give it."""
    acceleration: DisplayUnit
    """From m/s^2."""


def _system(name: str, label: str, **units: tuple[str, float, int]) -> UnitSystem:
    """Return the system of these quantities: unit, its number in one SI unit, decimals."""
    return UnitSystem(name, label, **{quantity: DisplayUnit(*unit) for quantity, unit in units.items()})


MM = _system(
    "mm",
    "mm",
    length=("mm", 1e3, 4),
    error=("µm", 1e6, 2),
    velocity=("mm/s", 1e3, 2),
    feed=("mm/min", 6e4, 1),
    acceleration=("mm/s²", 1e3, 1),
)
UM = _system(
    "um",
    "µm",
    length=("µm", 1e6, 1),
    error=("µm", 1e6, 2),
    velocity=("µm/s", 1e6, 0),
    feed=("µm/min", 6e7, 0),
    acceleration=("µm/s²", 1e6, 0),
)
INCH = _system(
    "inch",
    "inch",
    length=("in", 1.0 / INCH_M, 5),
    error=("µin", 1e6 / INCH_M, 0),
    velocity=("in/s", 1.0 / INCH_M, 4),
    feed=("in/min", 60.0 / INCH_M, 2),
    acceleration=("in/s²", 1.0 / INCH_M, 2),
)
UNIT_SYSTEMS = {system.name: system for system in (MM, UM, INCH)}


def unit_system(name: str | None) -> UnitSystem:
    """Return the system of that name; millimetres where the name is missing or unknown."""
    return UNIT_SYSTEMS.get(name or "", MM)
