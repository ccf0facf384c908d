"""The next experiment of a verdict as a paragraph: reason, motion with its numbers, what it decides."""

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
"""Unit by suffix of a key, the longest first."""
PHRASES = {
    "directions": "directions: {}",
    "times": "{} times",
    "cycles": "{} cycles",
    "record": "recorded {}",
    "record_too": "recorded too: {}",
    "then": "then {}",
}
"""Text of a number of the motion by its key, where it is not a quantity with a unit."""


def next_experiment_text(verdict: Mapping[str, Any]) -> str:
    """Return the next experiment of a verdict in the units of its axis."""
    experiment = verdict["next_experiment"]
    return paragraph(experiment, rotary=is_rotary(verdict, experiment.get("axis", "")))


def paragraph(experiment: Mapping[str, Any], *, rotary: bool = False) -> str:
    """Return the text of `next_experiment` of verdict.json; empty where nothing is open."""
    if not experiment:
        return ""
    numbers = "; ".join(_number(key, value) for key, value in experiment.items() if key not in PROSE_KEYS)
    axis, motion = experiment["axis"], experiment["motion"]
    parts = [f"{capitalised(experiment['why'])}.", f"On axis {axis}, record {motion}."]
    if numbers:
        parts[-1] = f"On axis {axis}, record {motion} ({numbers})."
    separated = [display_name(name) for name in experiment["separates"] if name != "unknown"]
    if len(separated) > 1:
        parts.append(f"That decides between {join_words(separated)}: {experiment['tells']}.")
    elif separated:
        parts.append(f"That shows {separated[0]}: {experiment['tells']}.")
    else:
        parts.append(f"That shows {experiment['tells']}.")
    if "evidence_nats" in experiment:
        parts += [
            _expected_evidence(experiment),
            f"`servo-ctrl run --program {experiment['program']}` makes it.",
        ]
    return sentence_of(" ".join(parts), rotary=rotary)


def _expected_evidence(experiment: Mapping[str, Any]) -> str:
    """State the expected evidence, and that of the least suitable motion."""
    nats, seconds = experiment["evidence_nats"], experiment["seconds"]
    other, other_nats = experiment["instead"]["motion"], experiment["instead"]["evidence_nats"]
    if other == experiment["motion"]:
        return f"It is expected to do so by {nats:g} nats in {seconds:g} s."
    return f"It is expected to do so by {nats:g} nats in {seconds:g} s; {other} would by {other_nats:g}."


def _number(key: str, value: Any) -> str:
    """Format a number of the motion by its key: `speeds 1, 2 and 4 mm/s`."""
    values = value if isinstance(value, list) else [value]
    text = join_words(f"{one:g}" if isinstance(one, int | float) else str(one) for one in values)
    if key in PHRASES:
        return PHRASES[key].format(text)
    for suffix, unit in UNITS.items():
        if key.endswith(suffix):
            return f"{display_name(key.removesuffix(suffix))} {text} {unit}"
    return f"{display_name(key)}: {text}"
