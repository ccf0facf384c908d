"""The verdict: what was left out, where it shows, what it is worth; as JSON."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from reconcile.catalogue.kinds import Sense
from reconcile.catalogue.registry import ENTRIES
from reconcile.replay_models import replays_json
from reconcile.views import verdict_noise, verdict_places
from servo_ctrl.config.file_format import FORMAT

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from reconcile.explain import Explanation
    from reconcile.findings import Finding
    from reconcile.replay_models import Replayed
    from reconcile.views import View

SCALE_ONLY = [
    name for name, entry in ENTRIES.items() if all(h.sense is Sense.DEVIATION for h in entry.HYPOTHESES)
]
"""Without a scale these cannot be told."""

MEAN_OF = {"constant_force": "position_dependent_force"}
"""A force that changes along the travel has a mean, and nobody knows where it is to be counted from."""
EVERYWHERE = ("presliding_hysteresis", "cogging")
"""Every axis has some of these: what is rarer is worth more to be told first."""
TWICE = 4.0
"""Of the variance: an effect twice as large."""


def verdict(
    axes: Mapping[str, Sequence[Explanation]],
    seen: Sequence[View],
    *,
    notes: Sequence[str] = (),
    replayed: Sequence[Replayed] = (),
    following: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """The whole of verdict.json; `following`: the next experiment."""
    everything = [(name, e) for name, explanations in axes.items() for e in explanations]
    findings = [_finding(name, f) for name, e in everything for f in e.findings]
    findings = _ranked(findings)
    matter = any(e.parameters_matter for _, e in everything)
    known = any(finding["effect"] != "unknown" for finding in findings)
    word = "effects" if known else "unknown" if findings else "parameters" if matter else "consistent"
    blind = [name for name, explanations in axes.items() if len(explanations) == 1]
    return {
        "format": FORMAT,
        "verdict": word,
        "notes": list(notes),
        "noise_floor": verdict_noise(seen),
        "located": verdict_places(seen),
        "findings": findings,
        "minor": [
            {"axis": name, "effect": f.effect, "heldout_gain": f.heldout_gain, "confidence": f.confidence}
            for name, e in everything
            for f in e.minor
        ],
        "not_observable": [{"axis": name, "effects": SCALE_ONLY, "why": "no scale"} for name in blind],
        "fit": {name: _fit(explanations, replayed, name) for name, explanations in axes.items()},
        "next_experiment": dict(following or {}),
    }


def _ranked(findings: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """By what each explains alone; what every axis has, and a mean after its whole; what has no name last."""

    def place(entry: Mapping[str, Any]) -> tuple[bool, float, bool]:
        whole = [
            other["share"]
            for other in findings
            if other["axis"] == entry["axis"] and other["effect"] == MEAN_OF.get(entry["effect"])
        ]
        share = min([float(entry["share"]), *whole])
        if entry["effect"] in EVERYWHERE:  # first only where it is twice as large as the next
            share /= TWICE
        return entry["effect"] == "unknown", -share, bool(whole)

    return sorted(findings, key=place)


def _fit(explanations: Sequence[Explanation], replayed: Sequence[Replayed], name: str) -> dict[str, Any]:
    """By sense; and by recording where the loop was replayed."""
    fit: dict[str, Any] = {
        e.sense.value: {
            "unit": "N" if e.sense is Sense.FORCE else "m",
            "before": e.before._asdict(),
            "refitted": e.refitted._asdict(),
            "after": e.after._asdict(),
            "values": e.base,
            "timing_s": e.timing_s,
        }
        for e in explanations
    }
    replays = replays_json(replayed, name)
    return {**fit, "replay": replays} if replays else fit


def _finding(axis: str, finding: Finding) -> dict[str, Any]:
    return {
        "axis": axis,
        "effect": finding.effect,
        "confidence": finding.confidence,
        "equivalent": finding.equivalent,
        "where": {"sensor": finding.sense, "axis": axis},
        "parameters": {
            key: {"value": p.value, "ci95": [p.low, p.high], "unit": p.unit}
            for key, p in finding.parameters.items()
        },
        "share": finding.share,
        "gain": finding.gain,
        "heldout_gain": finding.heldout_gain,
        "explanation": finding.explanation,
        "runners_up": [
            {"effect": r.effect, "confidence": r.confidence, "why_not": _why_not(r.share)}
            for r in finding.rivals
            if not math.isnan(r.confidence)
        ],
    }


def _why_not(share: float) -> str:
    return f"in its place it explains {100.0 * share:.0f} % as much of blocks that were not fitted"
