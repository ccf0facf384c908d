"""The stored part of a verdict and of a truth, from which a case is decided and scored without recordings."""

from typing import Any

from tests.campaigns.blind.families.decide import UNEXPLAINED

Row = dict[str, Any]
DIGITS = 6
"""Significant digits of stored numbers."""
OF_FINDING = ("axis", "effect", "over", "confidence", "equivalent", "share", "gain", "heldout_gain")
OF_TRUTH = ("family", "seed", "kind", "clutter", "foreign", "noise_floor", "force_rms")
OF_EFFECT = ("name", "parameters", "side", "also", "alike", "observable", "why_not", "rms", "floor", "share")


def kept_of_truth(truth: Row) -> Row:
    """Return the truth without the machine's values, which the seed determines."""
    effects = [{name: effect[name] for name in OF_EFFECT} for effect in truth["effects"]]
    kept: Row = rounded({name: truth[name] for name in OF_TRUTH} | {"effects": effects})
    return kept


def kept_of_verdict(verdict: Row) -> Row:
    """Return findings, sizes and fits of a verdict, in the form that verdict.json has."""
    findings = []
    for one in verdict["findings"]:
        values = {key: {k: of[k] for k in ("value", "ci95")} for key, of in one["parameters"].items()}
        own = {"sensor": one["where"]["sensor"], "best_rival": one["doubt"], "parameters": values}
        findings.append({name: one[name] for name in OF_FINDING} | own)
        if one["effect"] == "unknown" and not one["over"]:
            findings[-1]["over"] = UNEXPLAINED
    accounted = {
        axis: {
            channel: {
                "measured": of["measured"],
                "parts": {name: {"rms": part["rms"]} for name, part in of["parts"].items()},
                "left": of["left"],
                "matters": of["matters"],
                "is_noise": of["is_noise"],
            }
            for channel, of in channels.items()
        }
        for axis, channels in verdict["accounted"].items()
    }
    fits = {
        axis: {
            channel: {name: of[name] for name in ("before", "refitted", "after", "values")}
            for channel, of in channels.items()
            if channel in accounted.get(axis, {})
        }
        for axis, channels in verdict["fit"].items()
    }
    colour = {
        axis: {
            channel: of["whiteness"]["after"]["ljung_box_q"] / of["whiteness"]["after"]["degrees_of_freedom"]
            for channel, of in channels.items()
        }
        for axis, channels in verdict["noise_floor"].items()
    }
    kept: Row = rounded(
        {
            "verdict": verdict["verdict"],
            "findings": findings,
            "minor": verdict["minor"],
            "accounted": accounted,
            "fit": fits,
            "colour": colour,
        }
    )
    return kept


def rounded(content: Any) -> Any:
    """Return lists and mappings with their numbers of DIGITS significant digits."""
    if isinstance(content, float):
        return float(f"{content:.{DIGITS}g}")
    if isinstance(content, dict):
        return {key: rounded(of) for key, of in content.items()}
    if isinstance(content, list | tuple):
        return [rounded(of) for of in content]
    return content
