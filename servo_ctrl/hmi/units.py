"""What lengths look like on the page: SI inside, one of three systems outside."""

from __future__ import annotations

import math
from typing import NamedTuple

NOTHING = "\N{EM DASH}"
"""Shown where there is no value."""


class Scale(NamedTuple):
    """One quantity in one system: shown = value in SI times `factor`, with that many decimals."""

    unit: str
    factor: float
    decimals: int

    def text(self, value: float | None, *, sign: bool = False) -> str:
        """The number alone, without its unit; a dash where there is none."""
        if value is None or not math.isfinite(value):
            return NOTHING
        # what rounds to nothing has no sign
        rounded = round(value * self.factor, self.decimals) + 0.0
        shown = f"{rounded:{'+' if sign else ''},.{self.decimals}f}"
        return shown.replace(",", "\N{THIN SPACE}").replace("-", "\N{MINUS SIGN}")

    def with_unit(self, value: float | None, *, sign: bool = False) -> str:
        """Number and unit; a dash alone where there is none."""
        text = self.text(value, sign=sign)
        return text if text == NOTHING else f"{text} {self.unit}"


class Units(NamedTuple):
    """A system of units; the scales of the quantities that the page shows."""

    name: str
    label: str
    length: Scale
    """Of positions and travels, from metres."""
    error: Scale
    """Of deviations, which are some thousand times smaller, from metres."""
    velocity: Scale
    """From m/s."""
    feed: Scale
    """The same by the minute, as part programs have it."""
    acceleration: Scale
    """From m/s^2."""


_INCH_M = 0.0254
MM = Units(
    "mm",
    "mm",
    Scale("mm", 1e3, 4),
    Scale("\N{MICRO SIGN}m", 1e6, 2),
    Scale("mm/s", 1e3, 2),
    Scale("mm/min", 6e4, 1),
    Scale("mm/s\N{SUPERSCRIPT TWO}", 1e3, 1),
)
UM = Units(
    "um",
    "\N{MICRO SIGN}m",
    Scale("\N{MICRO SIGN}m", 1e6, 1),
    Scale("\N{MICRO SIGN}m", 1e6, 2),
    Scale("\N{MICRO SIGN}m/s", 1e6, 0),
    Scale("\N{MICRO SIGN}m/min", 6e7, 0),
    Scale("\N{MICRO SIGN}m/s\N{SUPERSCRIPT TWO}", 1e6, 0),
)
INCH = Units(
    "inch",
    "inch",
    Scale("in", 1.0 / _INCH_M, 5),
    Scale("\N{MICRO SIGN}in", 1e6 / _INCH_M, 0),
    Scale("in/s", 1.0 / _INCH_M, 4),
    Scale("in/min", 60.0 / _INCH_M, 2),
    Scale("in/s\N{SUPERSCRIPT TWO}", 1.0 / _INCH_M, 2),
)
SYSTEMS = {units.name: units for units in (MM, UM, INCH)}


def system_of(name: str | None) -> Units:
    """The system of that name; millimetres where there is none."""
    return SYSTEMS.get(name or "", MM)
