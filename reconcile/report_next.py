"""The next experiment as a paragraph: why, which motion with which numbers, what it decides."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from reconcile.report_words import listed, title

if TYPE_CHECKING:
    from collections.abc import Mapping

TOLD = (
    *("why", "separates", "axis", "motion", "tells"),
    *("program", "seconds", "evidence_nats", "instead", "also", "considered"),
)
"""What has its own place in the paragraph; all other keys are numbers of the motion."""
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
"""End of a key -> its unit, the longest first."""
PHRASES = {
    "directions": "directions: {}",
    "times": "{} times",
    "cycles": "{} cycles",
    "record": "recorded {}",
    "record_too": "recorded too: {}",
    "then": "then {}",
}


def paragraph(following: Mapping[str, Any]) -> str:
    """Of `next_experiment` of verdict.json; empty where nothing is open."""
    if not following:
        return ""
    numbers = [_number(key, value) for key, value in following.items() if key not in TOLD]
    motion = f"On axis {following['axis']}, record {following['motion']}"
    motion += f" ({'; '.join(numbers)})." if numbers else "."
    parts = [f"{_capital(following['why'])}.", motion]
    apart = [title(name) for name in following["separates"] if name != "unknown"]
    if len(apart) > 1:
        parts.append(f"That decides between {listed(apart)}: {following['tells']}.")
    elif apart:
        parts.append(f"That shows {apart[0]}: {following['tells']}.")
    else:
        parts.append(f"That shows {following['tells']}.")
    if "evidence_nats" in following:
        parts.append(_expected(following))
    return " ".join(parts)


def _expected(following: Mapping[str, Any]) -> str:
    """What it is expected to tell, what another motion would, and how to run it."""
    instead = following["instead"]
    told = f"It is expected to do so by {following['evidence_nats']:g} nats in {following['seconds']:g} s"
    if instead["motion"] != following["motion"]:
        told += f"; {instead['motion']} would by {instead['evidence_nats']:g}"
    return f"{told}. `servo-ctrl run --program {following['program']}` makes it."


def _number(key: str, value: Any) -> str:
    """`speeds 1, 2 and 4 mm/s`."""
    values = value if isinstance(value, list) else [value]
    said = listed(f"{one:g}" if isinstance(one, int | float) else str(one) for one in values)
    if key in PHRASES:
        return PHRASES[key].format(said)
    for end, unit in UNITS.items():
        if key.endswith(end):
            return f"{title(key.removesuffix(end))} {said} {unit}"
    return f"{title(key)}: {said}"


def _capital(sentence: str) -> str:
    return sentence[:1].upper() + sentence[1:]
