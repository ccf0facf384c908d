"""Score a verdict against the sealed truth of a case, by what stands in the two files alone."""

import math
import re
from collections import defaultdict
from typing import Any

from tests.campaigns.blind.families.decide import Rules, decided

Row = dict[str, Any]
FACTOR = 1.5
"""Bounds the reported unexplained RMS over the true one, and its inverse; chosen."""
UNNAMED = "unnamed terms"
UNIT = re.compile(r"_(n|nm|m|rad|s|hz|n_m|n_s_m|nm_s_rad|nm_rad|n_s2_m2|nm_s2_rad2|1_m)$")


def scores_of(rows: list[Row], rules: Rules | None = None) -> list[Row]:
    """Return scores of rows of the trial, each decided under `rules`, or as the engine decided."""
    return [
        row
        if "error" in row
        else scored(row["truth"], row["evidence"] if rules is None else decided(row["evidence"], rules))
        for row in rows
    ]


def scored(truth: Row, verdict: Row) -> Row:
    """Return what was planted, found, right, false and covered in one case."""
    names = {effect["name"] for effect in truth["effects"]}
    tolerated = {*truth["clutter"]}.union(*(effect["also"] + effect["alike"] for effect in truth["effects"]))
    findings = [one for one in verdict["findings"] if one["effect"] != "unknown"]
    classes = [{one["effect"], *one["equivalent"]} for one in findings]
    observable = [effect for effect in truth["effects"] if effect["observable"]]
    first = classes[0] if classes else set()
    right = {
        effect["name"]: any(({effect["name"], *effect["alike"]} & told) for told in classes)
        for effect in observable
    }
    false = [
        one["effect"]
        for one, told in zip(findings, classes, strict=True)
        if not told & names and one["effect"] not in tolerated
    ]
    return {
        "family": truth["family"],
        "seed": truth["seed"],
        "kind": truth["kind"],
        "planted": sorted(names),
        "observable": [effect["name"] for effect in observable],
        "findings": [{"effect": one["effect"], "confidence": one["confidence"]} for one in findings],
        "verdict": verdict["verdict"],
        "right": right,
        "first": any(({effect["name"], *effect["alike"]} & first) for effect in observable),
        "false": false,
        "unknown": _says_unknown(verdict),
        "with_parameter": [effect["name"] for effect in observable if effect["parameters"]],
        "covered": _covered(observable, findings),
        "unexplained": _unexplained(truth, verdict),
        "foreign_observable": bool(truth["foreign"] and truth["foreign"]["observable"]),
    }


def _says_unknown(verdict: Row) -> bool:
    """Return whether the tool says that there is physics which it cannot name."""
    return verdict["verdict"] == "unknown" or any(one["effect"] == "unknown" for one in verdict["findings"])


def _covered(observable: list[Row], findings: list[Row]) -> Row:
    """Return by effect and parameter whether the interval holds the truth; missing where none was stated."""
    covered = {}
    for effect in observable:
        found = [one for one in findings if effect["name"] in {one["effect"], *one["equivalent"]}]
        for name, true in effect["parameters"].items():
            stated = [
                value
                for one in found
                for key, value in one["parameters"].items()
                if _stem(key) == _stem(name)
            ]
            if stated:
                low, high = stated[0]["ci95"]
                covered[f"{effect['name']}.{name}"] = bool(low <= true <= high)
    return covered


def _stem(name: str) -> str:
    return UNIT.sub("", name)


def _unexplained(truth: Row, verdict: Row) -> Row | None:
    """Return the RMS of foreign force as it is and as it was reported; None where none is concealed.

    Told is what the verdict gives no name: its terms without a name, and what is left beside the noise.
    """
    if truth["foreign"] is None:
        return None
    parts = [axis["force"]["parts"] for axis in verdict["accounted"].values() if "force" in axis]
    nameless = [of[name]["rms"] for of in parts for name in ("unexplained", UNNAMED) if name in of]
    told = math.sqrt(sum(rms**2 for rms in nameless))
    true = truth["foreign"]["rms"]
    return {"true": true, "told": told, "within": bool(true / FACTOR <= told <= true * FACTOR)}


def summary(rows: list[Row]) -> Row:
    """Return by family the bars' figures: each a share with its count, null where nothing counts."""
    by_family: dict[str, list[Row]] = defaultdict(list)
    for row in rows:
        by_family[row["family"]].append(row)
    return {family: _figures(own) for family, own in sorted(by_family.items())}


def _figures(rows: list[Row]) -> Row:
    good = [row for row in rows if "error" not in row]
    single = [right for row in good if row["kind"] == "single" for right in row["right"].values()]
    first = [row["first"] for row in good if row["kind"] == "single" and row["right"]]
    several = [all(row["right"].values()) for row in good if row["kind"] == "several" and row["right"]]
    clean = [bool(row["false"]) for row in good if row["kind"] in {"quiet", "foreign"}]
    beside = [bool(row["false"]) for row in good if row["kind"] not in {"quiet", "foreign"}]
    foreign = [row["unknown"] for row in good if row["unexplained"] and row["foreign_observable"]]
    quiet = [row["unknown"] for row in good if row["kind"] == "quiet"]
    told = [row["unexplained"]["within"] for row in good if row["unexplained"] and row["foreign_observable"]]
    covered = [one for row in good for one in row["covered"].values()]
    shares = {
        "failed": ["error" in row for row in rows],
        "right_of_single": single,
        "first_of_single": first,
        "all_of_several": several,
        "false_names_quiet_and_foreign": clean,
        "false_names_beside_true": beside,
        "unknown_of_foreign": foreign,
        "unknown_of_quiet": quiet,
        "unexplained_within_factor": told,
        "intervals_cover": covered,
    }
    return {
        name: {"share": sum(all_) / len(all_) if all_ else None, "of": len(all_)}
        for name, all_ in shares.items()
    }
