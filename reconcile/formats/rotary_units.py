"""Units and words of a rotary axis, whose coordinate is an angle: the computation uses 1 m for 1 rad.

A millimetre becomes a milliradian, a newton a newton metre: numbers stay, their units change.
"""

import re
from collections.abc import Mapping
from typing import Any

UNITS = {
    "N": "N m",
    "m": "rad",
    "kg": "kg m^2",
    "m/s": "rad/s",
    "m/s^2": "rad/s^2",
    "N s/m": "N m s/rad",
    "N s^2/m^2": "N m s^2/rad^2",
    "N s2/m2": "N m s2/rad2",
    "N/m": "N m/rad",
    "m/N": "rad/(N m)",
    "rad/m": "rad/rad",
}
"""Unit of the computation -> unit of a rotary axis."""
SHOWN = {
    **UNITS,
    "N/um": "N m/urad",
    "N/mm": "N m/mrad",
    "um/m": "urad/rad",
    "um/N": "urad/(N m)",
    "mm/s^2": "mrad/s^2",
    "mm/s": "mrad/s",
    "um/s": "urad/s",
    "mm": "mrad",
    "um": "urad",
    "m/s²": "rad/s²",
    "mm/s²": "mrad/s²",
    "µm/s": "µrad/s",
    "µm": "µrad",
    "nm": "nrad",
    "newtons": "newton metres",
    "newton": "newton metre",
    "millimetres": "milliradians",
    "millimetre": "milliradian",
    "metres": "radians",
    "metre": "radian",
    "screw": "shaft",
}
"""Units and words of sentences -> those of a rotary axis."""
WORDS = frozenset(word for word in SHOWN if len(word) > 4 and word.isalpha())
_UNIT = "|".join(sorted((re.escape(unit) for unit in SHOWN if unit not in WORDS), key=len, reverse=True))
_WORD = "|".join(sorted(WORDS, key=len, reverse=True))
_SENTENCE = re.compile(
    rf"(?P<before>\d |\d\) |per |\()(?P<unit>{_UNIT})(?![\w/^]|\s[ms]\b)"
    rf"|(?<!newton )\b(?P<word>{_WORD})\b(?! metre)"
)
"""A unit after a number, "per" or a bracket, and a word anywhere."""


def unit_of(unit: str, *, rotary: bool) -> str:
    """Return a unit of the computation as a unit of the axis."""
    return UNITS.get(unit, unit) if rotary else unit


def sentence_of(text: str, *, rotary: bool) -> str:
    """Return a sentence in the units and words of the axis."""
    return _SENTENCE.sub(_as_rotary, text) if rotary else text


def _as_rotary(found: re.Match[str]) -> str:
    return SHOWN[found["word"]] if found["word"] else found["before"] + SHOWN[found["unit"]]


def in_units_of(content: Any, *, rotary: bool) -> Any:
    """Return the content of a verdict about one axis with the units and words of the axis.

    Keys that end with `unit` hold units; texts with a blank are sentences. Names of effects and parameters
    have no blank, and stay.
    """
    if not rotary:
        return content
    if isinstance(content, Mapping):
        return {
            key: unit_of(value, rotary=True) if key.endswith("unit") else in_units_of(value, rotary=True)
            for key, value in content.items()
        }
    if isinstance(content, list):
        return [in_units_of(one, rotary=True) for one in content]
    return sentence_of(content, rotary=True) if isinstance(content, str) and " " in content else content
