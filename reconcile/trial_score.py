"""One case scored: what was said against what was concealed."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

UNKNOWN, NEUTRAL, FALSE = "unknown", "neutral", "false"
AXIS = "x"
"""The axis that something is concealed in; others are there to be coupled."""
WHICH = ("harmonic", "period_m", "frequency_hz")
"""Parameters that say which of several periodic parts is meant."""
SAME_PART = 0.03
HALF = 0.5
"""Of the effect's RMS: clutter that is smaller must not come first."""


def score(truth: Mapping[str, Any], verdict: Mapping[str, Any]) -> dict[str, Any]:
    """A row: truth and verdict in short, and how they agree."""
    planted = truth["effects"]
    findings = verdict["findings"]
    known = [effect for effect in planted if effect["catalogue"] and effect["observable"]]
    meant = _meant(truth, findings)
    return {
        "kind": truth["kind"],
        "production": truth["production"],
        "sensing": {key: truth["sensing"][key] for key in ("has_scale", "has_temperature", "is_command")},
        "nominal": truth["nominal"],
        "recordings": len(truth["runs"]),
        "planted": [
            {key: effect[key] for key in ("name", "catalogue", "observable", "why_not", "share", "deviation")}
            for effect in planted
        ],
        "verdict": verdict["verdict"],
        "error": verdict.get("error", ""),
        "findings": [
            {key: f[key] for key in ("effect", "confidence", "equivalent", "heldout_gain")} for f in findings
        ],
        "first": _first(truth, known, findings, meant),
        "found": [effect["name"] for effect in known if effect["name"] in meant],
        "false": [f["effect"] for f, true in zip(findings, meant, strict=True) if true == FALSE],
        "called_unknown": UNKNOWN in meant or verdict["verdict"] == UNKNOWN,
        "stated": [
            {"confidence": f["confidence"], "right": true != FALSE}
            for f, true in zip(findings, meant, strict=True)
            if true != UNKNOWN
        ],
        "parameters": [entry for effect in known for entry in _parameters(effect, findings)],
    }


def _names(effect: Mapping[str, Any]) -> set[str]:
    return {effect["name"], *effect["alike"]}


def _meant(truth: Mapping[str, Any], findings: Sequence[Mapping[str, Any]]) -> list[str]:
    """What each finding is: the concealed effect that it means, neutral, unknown, or false.

    First by its name or one of its class. What is left may mean by its declared equivalents what no other
    finding has named.
    """
    neutral = set(truth["clutter"]) | {name for effect in truth["effects"] for name in effect["also"]}
    meant = [FALSE] * len(findings)
    for index, finding in enumerate(findings):
        own = [effect["name"] for effect in truth["effects"] if finding["effect"] in _names(effect)]
        if finding["effect"] == UNKNOWN:
            meant[index] = UNKNOWN
        elif own and finding["axis"] == AXIS:
            meant[index] = own[0]
        elif finding["effect"] in neutral:
            meant[index] = NEUTRAL
    named = {finding["effect"] for finding in findings}
    for index, finding in enumerate(findings):
        if meant[index] != FALSE:
            continue
        alike = {*finding["equivalent"]} - named
        own = [effect["name"] for effect in truth["effects"] if effect["name"] in alike]
        if own and finding["axis"] == AXIS:
            meant[index] = own[0]
        elif neutral & alike:
            meant[index] = NEUTRAL
    return meant


def _first(
    truth: Mapping[str, Any],
    known: Sequence[Mapping[str, Any]],
    findings: Sequence[Mapping[str, Any]],
    meant: Sequence[str],
) -> str:
    """What was named first: right, class, clutter, unknown, nothing, or the false name itself.

    Clutter in the other of the two differences, or of half the effect's size or more, may be named before; so
    may what is concealed but too small to count.
    """
    if not known:
        return ""
    forces = [effect["rms"] for effect in known if not effect["deviation"]]
    large = {name for name, rms in truth["clutter"].items() if not forces or rms >= HALF * max(forces)}
    for finding, true in zip(findings, meant, strict=True):
        if any(true == effect["name"] for effect in known):
            return "right" if finding["effect"] == true else "class"
        if true in {UNKNOWN, FALSE}:
            return str(finding["effect"])
        if true == NEUTRAL and finding["effect"] not in large:
            return "clutter"
    return "nothing"


def _parameters(effect: Mapping[str, Any], findings: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Each parameter that truth and verdict both have: truth, value, interval."""
    own = next((f for f in findings if f["effect"] in _names(effect)), None)
    if own is None or not own["parameters"] or not effect["parameters"]:
        return []
    parts: dict[str, dict[str, Any]] = {}
    for key, value in own["parameters"].items():
        stem, _, number = key.rpartition("_")
        part, name = (number, stem) if number.isdigit() and stem in effect["parameters"] else ("", key)
        parts.setdefault(part, {})[name] = value
    which = [key for key in WHICH if key in effect["parameters"]]
    best = min(parts.values(), key=lambda part: sum(_off(part, key, effect) for key in which))
    if any(_off(best, key, effect) > SAME_PART for key in which):
        return []
    return [
        {
            "effect": effect["name"],
            "parameter": key,
            "truth": value,
            "value": best[key]["value"],
            "ci95": best[key]["ci95"],
            "covered": best[key]["ci95"][0] <= value <= best[key]["ci95"][1],
            "error": abs(best[key]["value"] / value - 1.0) if value else None,
        }
        for key, value in effect["parameters"].items()
        if key in best and key not in WHICH
    ]


def _off(part: Mapping[str, Any], key: str, effect: Mapping[str, Any]) -> float:
    return abs(part[key]["value"] / effect["parameters"][key] - 1.0) if key in part else math.inf
