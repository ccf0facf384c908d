"""The next experiment of a verdict as a paragraph: reason, motion with its numbers, and what it decides."""

from collections.abc import Mapping
from typing import Any

from reconcile.formats.rotary_units import sentence_of
from reconcile.report.words import capitalised, display_name, is_rotary, join_words

PROSE_KEYS = (
    *("why", "separates", "axis", "motion", "tells"),
    *("program", "seconds", "evidence_nats", "instead", "also", "considered"),
)
"""Keys with their own place in the paragraph; all others are numbers of the motion."""
UNITS = {
    "_mm_s2": "mm/s²",
    "_mm_s": "mm/s",
    "_mm": "mm",
    "_um": "µm",
    "_hz": "Hz",
    "_kg": "kg",
    "_n": "N",
    "_s": "s",
}
"""Suffix of a key -> its unit, the longest first."""
PHRASES = {
    "directions": "directions: {}",
    "times": "{} times",
    "cycles": "{} cycles",
    "record": "recorded {}",
    "record_too": "recorded too: {}",
    "then": "then {}",
}


def following_text(verdict: Mapping[str, Any]) -> str:
    """Return the next experiment of a verdict in the units of its axis."""
    following = verdict["next_experiment"]
    return paragraph(following, rotary=is_rotary(verdict, following.get("axis", "")))


def paragraph(following: Mapping[str, Any], *, rotary: bool = False) -> str:
    """Return the text of `next_experiment` of verdict.json; empty where nothing is open."""
    if not following:
        return ""
    numbers = "; ".join(_number(key, value) for key, value in following.items() if key not in PROSE_KEYS)
    axis, motion = following["axis"], following["motion"]
    parts = [f"{capitalised(following['why'])}.", f"On axis {axis}, record {motion}."]
    if numbers:
        parts[-1] = f"On axis {axis}, record {motion} ({numbers})."
    apart = [display_name(name) for name in following["separates"] if name != "unknown"]
    if len(apart) > 1:
        parts.append(f"That decides between {join_words(apart)}: {following['tells']}.")
    elif apart:
        parts.append(f"That shows {apart[0]}: {following['tells']}.")
    else:
        parts.append(f"That shows {following['tells']}.")
    if "evidence_nats" in following:
        parts += [_expected(following), f"`servo-ctrl run --program {following['program']}` makes it."]
    return sentence_of(" ".join(parts), rotary=rotary)


def _expected(following: Mapping[str, Any]) -> str:
    """State the expected evidence, and that of the least suitable motion."""
    instead, nats, seconds = following["instead"], following["evidence_nats"], following["seconds"]
    other, of_other = instead["motion"], instead["evidence_nats"]
    if other == following["motion"]:
        return f"It is expected to do so by {nats:g} nats in {seconds:g} s."
    return f"It is expected to do so by {nats:g} nats in {seconds:g} s; {other} would by {of_other:g}."


def _number(key: str, value: Any) -> str:
    """Format a number of the motion by its key: `speeds 1, 2 and 4 mm/s`."""
    values = value if isinstance(value, list) else [value]
    text = join_words(f"{one:g}" if isinstance(one, int | float) else str(one) for one in values)
    if key in PHRASES:
        return PHRASES[key].format(text)
    for end, unit in UNITS.items():
        if key.endswith(end):
            return f"{display_name(key.removesuffix(end))} {text} {unit}"
    return f"{display_name(key)}: {text}"
