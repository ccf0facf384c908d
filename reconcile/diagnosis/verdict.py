"""verdict.json: identified effects, locations of the residual, fit, and the next experiment."""

import math
from collections.abc import Container, Mapping, Sequence
from typing import Any

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.catalogue.registry import CATALOGUE, ENTRIES
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.formats.rotary_units import in_units_of
from reconcile.identification.explain import Explanation
from reconcile.identification.findings import LEAST_REPORTED_GAIN, IdentifiedEffect
from reconcile.location.residual_analysis import ResidualAnalysis, located_of_verdict, noise_of_verdict
from reconcile.proof.proof import Proof, proof_json
from reconcile.replay.model_replays import ReplayComparison, replays_json
from servo_ctrl.config.file_format import FORMAT

SCALE_ONLY = [
    name
    for name, entry in ENTRIES.items()
    if all(f.channel is ResidualChannel.POSITION_DEVIATION or f.if_excited for f in entry.terms)
]
"""Effects that ordinary motions do not show without a scale."""
COMMON_EFFECT_RATIO = 4.0
"""Of variance, so twice the size: an effect that every axis has comes first only if it is so much larger."""


def verdict(
    axes: Mapping[str, Sequence[Explanation]],
    analyses: Sequence[ResidualAnalysis],
    *,
    notes: Sequence[str] = (),
    replayed: Sequence[ReplayComparison] = (),
    proofs: Mapping[str, Sequence[Proof]] | None = None,
    following: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Return the content of verdict.json; `proofs` by axis, `following` is the next experiment."""
    everything = [(name, e) for name, explanations in axes.items() for e in explanations]
    findings = _ranked([_finding(name, f) for name, e in everything for f in _with_law(e)])
    is_worse = any(e.nominal_is_worse for _, e in everything)
    known = any(finding["effect"] != "unknown" for finding in findings)
    word = "effects" if known else "unknown" if findings else "parameters" if is_worse else "consistent"
    blind = [name for name, explanations in axes.items() if len(explanations) == 1]
    found = {(finding["axis"], finding["effect"]) for finding in findings}
    content = {
        "format": FORMAT,
        "verdict": word,
        "notes": list(notes),
        "proof": {name: [proof_json(one) for one in of] for name, of in (proofs or {}).items()},
        "accounted": {name: _accounted(explanations) for name, explanations in axes.items()},
        "withdrawn": [
            {"axis": name, "effect": one.effect, "why": one.why}
            for name, e in everything
            for one in e.withdrawn
        ],
        "noise_floor": noise_of_verdict(analyses),
        "located": located_of_verdict(analyses),
        "findings": findings,
        "minor": [
            {"axis": name, "effect": f.effect, "heldout_gain": f.heldout_gain, "confidence": f.confidence}
            for name, e in everything
            for f in e.minor
        ],
        "not_observable": [
            {"axis": axis, "effects": [e for e in SCALE_ONLY if (axis, e) not in found], "why": "no scale"}
            for axis in blind
        ],
        "fit": {name: _fit(explanations, replayed, name) for name, explanations in axes.items()},
        "next_experiment": dict(following or {}),
    }
    rotary = {one.axis for one in analyses if one.nominal.rotary}
    return {key: _in_units_of(of, rotary) for key, of in content.items()} if rotary else content


def _in_units_of(content: Any, rotary: Container[str]) -> Any:
    """A part of the verdict, a list of entries or one by axis, in the units of the axes."""
    if isinstance(content, Mapping):
        return {name: in_units_of(of, rotary=name in rotary) for name, of in content.items()}
    if isinstance(content, list):
        return [
            in_units_of(one, rotary=one["axis"] in rotary) if isinstance(one, Mapping) else one
            for one in content
        ]
    return content


def _accounted(explanations: Sequence[Explanation]) -> dict[str, Any]:
    return {
        e.channel.value: e.accounted.as_json("N" if e.channel is ResidualChannel.FORCE else "m")
        for e in explanations
        if e.accounted is not None
    }


def _ranked(findings: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Sort findings by the share that each explains alone, unnamed ones last.

    Effects that every axis has rank lower, and the mean of an effect ranks after the effect itself.
    """

    def place(finding: Mapping[str, Any]) -> tuple[bool, float, bool]:
        entry = CATALOGUE.get(finding["effect"])
        whole = [
            other["share"]
            for other in findings
            if entry and other["axis"] == finding["axis"] and other["effect"] == entry.mean_of
        ]
        share = min([float(finding["share"]), *whole])
        if entry and entry.on_every_axis:
            share /= COMMON_EFFECT_RATIO
        return finding["effect"] == "unknown", -share, bool(whole)

    return sorted(findings, key=place)


def _fit(
    explanations: Sequence[Explanation], replayed: Sequence[ReplayComparison], name: str
) -> dict[str, Any]:
    """Return the RMS levels and base values by channel, and the replays by recording."""
    fit: dict[str, Any] = {
        e.channel.value: {
            "unit": "N" if e.channel is ResidualChannel.FORCE else "m",
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


def _with_law(explanation: Explanation) -> list[IdentifiedEffect]:
    """Return the findings; a curve in the force that is a law bears its name unless a finding has it already.

    The curve must explain held-out variance alone: beside others it may be their misfit. Curves with
    coefficients of each recording are not a law.
    """
    named = {finding.effect for finding in explanation.findings}
    found = []
    for finding in explanation.findings:
        law = finding.law
        is_shared = not any(c.per_recording for c in finding.candidates)
        in_force = explanation.channel is ResidualChannel.FORCE
        if law and law not in named and in_force and is_shared and finding.share >= LEAST_REPORTED_GAIN:
            _, _, curve = finding.explanation.partition(": ")
            why = f"{CATALOGUE[law].shown_by}: {curve}"
            equivalent = [effect for effect in finding.equivalent if effect != law]
            found.append(finding._replace(effect=law, equivalent=equivalent, explanation=why))
        else:
            found.append(finding)
    return found


def _finding(axis: str, finding: IdentifiedEffect) -> dict[str, Any]:
    return {
        "axis": axis,
        "effect": finding.effect,
        "over": _coordinate(finding),
        "confidence": finding.confidence,
        "doubt": finding.doubt,
        "equivalent": finding.equivalent,
        "where": {"sensor": finding.channel, "axis": axis},
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


def _coordinate(finding: IdentifiedEffect) -> str:
    """What a term without a name changes with; empty of named effects and of what has no term."""
    effect = finding.candidates[0].effect if finding.candidates else ""
    return effect.removeprefix(PREFIX) if effect.startswith(PREFIX) else ""


def _why_not(share: float) -> str:
    return f"in its place it explains {100.0 * share:.0f} % as much of blocks that were not fitted"
