"""One case scored: what was said against what was concealed."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

UNKNOWN = "unknown"
WHICH = ("harmonic", "period_m", "frequency_hz")
"""Parameters that say which of several periodic parts is meant."""
SAME_PART = 0.03


def score(truth: Mapping[str, Any], verdict: Mapping[str, Any]) -> dict[str, Any]:
    """A row: truth and verdict in short, and how they agree."""
    planted = truth["effects"]
    findings = verdict["findings"]
    known = [effect for effect in planted if effect["catalogue"] and effect["observable"]]
    neutral = _neutral(truth)
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
        "first": _first(truth, known, findings),
        "found": [effect["name"] for effect in known if any(_means(f, effect) for f in findings)],
        "false": [f["effect"] for f in findings if _false(f, planted, neutral)],
        "called_unknown": any(f["effect"] == UNKNOWN for f in findings) or verdict["verdict"] == UNKNOWN,
        "stated": [
            {"confidence": f["confidence"], "right": not _false(f, planted, neutral)}
            for f in findings
            if f["effect"] != UNKNOWN
        ],
        "parameters": [entry for effect in known for entry in _parameters(effect, findings)],
    }


def _names(effect: Mapping[str, Any]) -> set[str]:
    return {effect["name"], *effect["alike"]}


def _means(finding: Mapping[str, Any], effect: Mapping[str, Any]) -> bool:
    """Its name, one of its class, or a class that it is declared to be in; `unknown` means no effect."""
    return finding["effect"] != UNKNOWN and bool(
        finding["effect"] in _names(effect) or {effect["name"]} & {*finding["equivalent"]}
    )


def _neutral(truth: Mapping[str, Any]) -> set[str]:
    """Names that are true beside what counts: clutter, what is too small to count, by-products."""
    names = set(truth["clutter"])
    for effect in truth["effects"]:
        names |= {*effect["also"]}
        if not effect["observable"]:
            names |= _names(effect)
    return names


def _false(finding: Mapping[str, Any], planted: Sequence[Mapping[str, Any]], neutral: set[str]) -> bool:
    if finding["effect"] == UNKNOWN or finding["effect"] in neutral:
        return False
    if neutral & {*finding["equivalent"]}:
        return False
    return not any(_means(finding, effect) for effect in planted)


def _first(
    truth: Mapping[str, Any], known: Sequence[Mapping[str, Any]], findings: Sequence[Mapping[str, Any]]
) -> str:
    """What was named first: right, class, clutter, unknown, nothing, or the false name itself.

    Clutter in the other of the two differences, or larger than every planted effect, may be named before.
    """
    if not known:
        return ""
    most = max((effect["rms"] for effect in known if not effect["deviation"]), default=0.0)
    force = any(not effect["deviation"] for effect in known)
    also = {name for effect in truth["effects"] for name in effect["also"]}
    allowed = {name for name, rms in truth["clutter"].items() if not force or rms >= most}
    said = "nothing"
    for finding in findings:
        if any(finding["effect"] == effect["name"] for effect in known):
            return "right"
        if any(_means(finding, effect) for effect in known):
            return "class"
        if finding["effect"] in allowed:
            continue
        if finding["effect"] in {*truth["clutter"], *also}:
            return "clutter"
        return str(finding["effect"])
    return said


def _parameters(effect: Mapping[str, Any], findings: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Each parameter that truth and verdict both have: truth, value, interval."""
    own = next((f for f in findings if f["effect"] in _names(effect)), None)
    if own is None or not effect["parameters"]:
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
