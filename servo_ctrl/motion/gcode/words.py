"""The G and M words of a part program: the effect of each word, and why some are refused.

Two words of one group contradict each other in a block. docs/part_programs.md has this table.
"""

from enum import Enum
from typing import NamedTuple


class Effect(Enum):
    """The effect of a word."""

    ACTS = "acts"
    HOLDS = "holds anyway"
    """The word requests a state that always applies."""
    NONE = "has no effect here"
    REFUSED = "refused"


class Code(NamedTuple):
    """One G or M word; for a refused word `meaning` is the reason."""

    group: str
    effect: Effect
    meaning: str


WORK_OFFSETS = ("G54", "G55", "G56", "G57", "G58", "G59")
"""Work offsets in the order of their numbers in 2104h:09."""
_COMPENSATION = "there is no cutter compensation; let the CAM system write the path of the tool's centre"
_CYCLE = "there are no canned cycles; write the moves out"
_LENGTH = "there are no tool lengths here"
_OFFSET = "axes are offset by G54 to G59 alone"
_SUBPROGRAM = "there are no subprograms; write the program out"

G_CODES: dict[str, Code] = {
    "G0": Code("motion", Effect.ACTS, "rapid move in a straight line, as fast as the axes allow"),
    "G1": Code("motion", Effect.ACTS, "straight line at the feed F"),
    "G2": Code("motion", Effect.ACTS, "arc clockwise, by R or by the centre"),
    "G3": Code("motion", Effect.ACTS, "arc counterclockwise, likewise"),
    "G4": Code("dwell", Effect.ACTS, "dwell of P or X seconds"),
    "G9": Code("exact stop", Effect.ACTS, "exact stop at the end of this block"),
    "G17": Code("plane", Effect.ACTS, "arcs in x and y, centre by I and J; holds at the start"),
    "G18": Code("plane", Effect.ACTS, "arcs in z and x, centre by K and I"),
    "G19": Code("plane", Effect.ACTS, "arcs in y and z, centre by J and K"),
    "G20": Code("units", Effect.ACTS, "inches"),
    "G21": Code("units", Effect.ACTS, "millimetres; holds at the start"),
    "G40": Code("cutter compensation", Effect.HOLDS, "no cutter compensation"),
    **dict.fromkeys(("G41", "G42"), Code("cutter compensation", Effect.REFUSED, _COMPENSATION)),
    **dict.fromkeys(("G43", "G44"), Code("tool length", Effect.REFUSED, _LENGTH)),
    "G49": Code("tool length", Effect.HOLDS, "no tool length"),
    "G54": Code("work offset", Effect.ACTS, "work offset of --g54 or of the page; holds at the start"),
    **dict.fromkeys(
        WORK_OFFSETS[1:], Code("work offset", Effect.ACTS, "another work offset, once it was set")
    ),
    "G61": Code("path control", Effect.ACTS, "exact stop at the end of every block"),
    "G64": Code("path control", Effect.ACTS, "corners are rounded within P; P0.01 mm holds at the start"),
    "G80": Code("canned cycle", Effect.HOLDS, "no canned cycle"),
    **dict.fromkeys(("G81", "G82", "G83", "G84", "G85"), Code("canned cycle", Effect.REFUSED, _CYCLE)),
    "G90": Code("distance", Effect.ACTS, "absolute coordinates; holds at the start"),
    "G90.1": Code("arc centre", Effect.REFUSED, "I, J and K are incremental, from the start of the arc"),
    "G91": Code("distance", Effect.ACTS, "incremental coordinates"),
    "G91.1": Code("arc centre", Effect.HOLDS, "I, J and K are incremental, from the start of the arc"),
    "G92": Code("axis offset", Effect.REFUSED, _OFFSET),
    "G93": Code("feed mode", Effect.REFUSED, "the feed is per minute, G94"),
    "G94": Code("feed mode", Effect.HOLDS, "the feed is per minute"),
    "G95": Code("feed mode", Effect.REFUSED, "there is no spindle to feed by; the feed is per minute, G94"),
    "G96": Code("spindle speed", Effect.NONE, "constant surface speed"),
    "G97": Code("spindle speed", Effect.NONE, "constant spindle speed"),
    **dict.fromkeys(("G98", "G99"), Code("return level", Effect.NONE, "return level of canned cycles")),
    **dict.fromkeys(
        ("G28", "G30"), Code("reference", Effect.REFUSED, "write the move to the reference position as G0")
    ),
    "G53": Code("reference", Effect.REFUSED, "machine coordinates are those of G54 without --g54"),
}
M_CODES: dict[str, Code] = {
    "M0": Code("stop", Effect.REFUSED, "there is nobody to press start again; use G4, or two programs"),
    "M1": Code("stop", Effect.ACTS, "optional stop: held there where the setting is on, else nothing"),
    **dict.fromkeys(("M2", "M30"), Code("stop", Effect.ACTS, "end of the program")),
    "M3": Code("spindle", Effect.NONE, "spindle clockwise"),
    "M4": Code("spindle", Effect.NONE, "spindle counterclockwise"),
    "M5": Code("spindle", Effect.NONE, "spindle off"),
    "M6": Code("tool change", Effect.NONE, "tool change"),
    "M7": Code("coolant mist", Effect.NONE, "mist on"),
    "M8": Code("coolant flood", Effect.NONE, "flood on"),
    "M9": Code("coolant off", Effect.NONE, "coolant off"),
    "M48": Code("override", Effect.NONE, "overrides on"),
    "M49": Code("override", Effect.NONE, "overrides off"),
    **dict.fromkeys(("M97", "M98", "M99"), Code("subprogram", Effect.REFUSED, _SUBPROGRAM)),
}

LETTERS_WITHOUT_EFFECT = {"S": "spindle speed", "T": "tool"}


def code_name(letter: str, value: float) -> str:
    """Return the name of a G or M word in the tables: G1 for "G01" and "g1.0", G91.1."""
    return f"{letter}{value:.10g}"
