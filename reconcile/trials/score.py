"""Score one case: the findings of a verdict against the concealed effects."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

UNKNOWN, NEUTRAL, FALSE = "unknown", "neutral", "false"
AXIS = "x"
"""The axis with concealed effects; others serve as sources of coupling."""
WHICH = ("harmonic", "period_m", "frequency_hz")
"""Parameters that identify one of several periodic parts."""
SAME_PART = 0.03
"""Relative difference of such a parameter within which truth and finding are the same part; chosen."""
LARGE_CLUTTER = 0.5
"""Of the largest effect's RMS: smaller clutter must not come first; chosen."""


def score(truth: Mapping[str, Any], verdict: Mapping[str, Any]) -> dict[str, Any]:
    """Return the row of a case: truth and verdict in short, and how they agree."""
    planted = truth["effects"]
    findings = verdict["findings"]
    known = [effect for effect in planted if effect["catalogue"] and effect["observable"]]
    meanings = _meanings(truth, findings)
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
        "first": _first(truth, known, findings, meanings),
        "found": [effect["name"] for effect in known if effect["name"] in meanings],
        "false": [f["effect"] for f, true in zip(findings, meanings, strict=True) if true == FALSE],
        "called_unknown": UNKNOWN in meanings or verdict["verdict"] == UNKNOWN,
        "stated": [
            {"confidence": f["confidence"], "right": true != FALSE}
            for f, true in zip(findings, meanings, strict=True)
            if true != UNKNOWN
        ],
        "parameters": [entry for effect in known for entry in _parameters(effect, findings)],
    }


def _names(effect: Mapping[str, Any]) -> set[str]:
    return {effect["name"], *effect["alike"]}


def _meanings(truth: Mapping[str, Any], findings: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return for each finding the concealed effect that it means, or neutral, unknown, false.

    A finding means an effect by its name or class; else by a declared equivalent that no other finding names.
    """
    neutral = set(truth["clutter"]) | {name for effect in truth["effects"] for name in effect["also"]}
    meanings = [FALSE] * len(findings)
    for index, finding in enumerate(findings):
        own = [effect["name"] for effect in truth["effects"] if finding["effect"] in _names(effect)]
        if finding["effect"] == UNKNOWN:
            meanings[index] = UNKNOWN
        elif own and finding["axis"] == AXIS:
            meanings[index] = own[0]
        elif finding["effect"] in neutral:
            meanings[index] = NEUTRAL
    named = {finding["effect"] for finding in findings}
    for index, finding in enumerate(findings):
        if meanings[index] != FALSE:
            continue
        alike = {*finding["equivalent"]} - named
        own = [effect["name"] for effect in truth["effects"] if effect["name"] in alike]
        if own and finding["axis"] == AXIS:
            meanings[index] = own[0]
        elif neutral & alike:
            meanings[index] = NEUTRAL
    return meanings


def _first(
    truth: Mapping[str, Any],
    known: Sequence[Mapping[str, Any]],
    findings: Sequence[Mapping[str, Any]],
    meanings: Sequence[str],
) -> str:
    """Return what was named first: right, class, clutter, unknown, nothing, or the false name itself.

    Clutter of the other channel or of at least half the effect's size may come before without harm; so may a
    concealed effect that is too small to count.
    """
    if not known:
        return ""
    forces = [effect["rms"] for effect in known if not effect["deviation"]]
    large = {
        name for name, rms in truth["clutter"].items() if not forces or rms >= LARGE_CLUTTER * max(forces)
    }
    for finding, true in zip(findings, meanings, strict=True):
        if any(true == effect["name"] for effect in known):
            return "right" if finding["effect"] == true else "class"
        if true in {UNKNOWN, FALSE}:
            return str(finding["effect"])
        if true == NEUTRAL and finding["effect"] not in large:
            return "clutter"
    return "nothing"


def _parameters(effect: Mapping[str, Any], findings: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return truth, value and interval of each parameter that truth and verdict both have."""
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
