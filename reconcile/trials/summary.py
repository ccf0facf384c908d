"""Summarise the rows of blind trials: scores with confidence intervals over the cases."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.stats import binomtest

Row = Mapping[str, Any]

RESAMPLES = 2000
"""Bootstrap resamples of the cases."""
EDGES = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0 + 1e-9)
RIGHT = ("right", "class")


def summary(rows: Sequence[Row]) -> dict[str, Any]:
    """Return all scores, the table by effect, the confusions, and the reliability of the confidences."""
    single = [row for row in rows if row["kind"] == "single" and _known(row)]
    several = [row for row in rows if row["kind"] == "several" and _known(row)]
    quiet = [row for row in rows if row["kind"] in {"none", "parameters"}]
    foreign = [row for row in rows if row["kind"] == "foreign" and _seen(row)]
    hidden = [row for row in rows if row["planted"] and not _seen(row)]
    stated = [entry for row in rows for entry in row["stated"]]
    return {
        "scores": {
            "right_first_name": _share(single, lambda row: row["first"] == "right"),
            "right_first_name_or_class": _share(single, lambda row: row["first"] in RIGHT),
            "named_at_all": _share(single, lambda row: bool(row["found"])),
            "abstained": _share(single, lambda row: row["first"] in {"nothing", "clutter"}),
            "said_unknown_of_known": _share(single, lambda row: row["first"] == "unknown"),
            "all_of_several": _share(several, lambda row: len(row["found"]) == len(_known(row))),
            "false_names_quiet": _share([*quiet, *foreign], lambda row: bool(row["false"])),
            "false_names_effect_free": _share(quiet, lambda row: bool(row["false"])),
            "false_names_foreign": _share(foreign, lambda row: bool(row["false"])),
            "false_names_beside_planted": _share([*single, *several], lambda row: bool(row["false"])),
            "false_names_not_observable": _share(hidden, lambda row: bool(row["false"])),
            "unknown_called_unknown": _share(foreign, lambda row: row["called_unknown"] and not row["false"]),
            "intervals_cover": _by_case([[p["covered"] for p in row["parameters"]] for row in rows], np.mean),
            "parameter_error_median": _by_case([_errors(row) for row in rows], np.median),
            "achieved_gain": _by_case([_achieved(row) for row in [*single, *several]], np.median),
            "achieved_gain_mean": _by_case([_achieved(row) for row in [*single, *several]], np.mean),
            "seconds_median": _by_case([[row["seconds"]] for row in rows], np.median),
            "failed": _share(rows, lambda row: bool(row["error"])),
        },
        "by_effect": _by_effect([*single, *several]),
        "confusion": _confusion(single),
        "reliability": _reliability(stated),
    }


def wilson(successes: int, of: int) -> tuple[float, float]:
    """Return Wilson's 95 % interval of a share; all of it where nothing was counted."""
    if of == 0:
        return 0.0, 1.0
    interval = binomtest(successes, of).proportion_ci(method="wilson")
    return float(interval.low), float(interval.high)


def _share(rows: Sequence[Row], true: Callable[[Row], bool]) -> dict[str, Any]:
    count = sum(true(row) for row in rows)
    low, high = wilson(count, len(rows))
    return {"value": count / len(rows) if rows else None, "ci95": [low, high], "of": len(rows)}


def _by_case(values: Sequence[Sequence[float]], statistic: Callable[[Any], Any]) -> dict[str, Any]:
    """Return a statistic of all values, with a bootstrap interval that resamples whole cases."""
    cases = [np.array(of, dtype=np.float64) for of in values if len(of)]
    if not cases:
        return {"value": None, "ci95": [None, None], "of": 0}
    rng = np.random.default_rng(0)
    drawn = [
        float(statistic(np.concatenate([cases[i] for i in rng.integers(len(cases), size=len(cases))])))
        for _ in range(RESAMPLES)
    ]
    low, high = np.percentile(drawn, [2.5, 97.5])
    everything = np.concatenate(cases)
    return {"value": float(statistic(everything)), "ci95": [float(low), float(high)], "of": len(everything)}


def _known(row: Row) -> list[str]:
    """Return the concealed effects that are in the catalogue and observable."""
    return [effect["name"] for effect in row["planted"] if effect["catalogue"] and effect["observable"]]


def _seen(row: Row) -> bool:
    return any(effect["observable"] for effect in row["planted"])


def _errors(row: Row) -> list[float]:
    return [entry["error"] for entry in row["parameters"] if entry["error"] is not None]


def _achieved(row: Row) -> list[float]:
    """Return the achieved shares of the channels in which an effect of the case shows."""
    channels = {
        "deviation" if effect["deviation"] else "force"
        for effect in row["planted"]
        if effect["catalogue"] and effect["observable"]
    }
    shares = [row["achieved"][channel]["share"] for channel in sorted(channels) if channel in row["achieved"]]
    return [max(share, -1.0) for share in shares if share is not None]


def _by_effect(rows: Sequence[Row]) -> list[dict[str, Any]]:
    table = []
    for name in sorted({name for row in rows for name in _known(row)}):
        own = [row for row in rows if name in _known(row)]
        alone = [row for row in own if row["kind"] == "single"]
        table.append(
            {
                "effect": name,
                "single": len(alone),
                "first": sum(row["first"] in RIGHT for row in alone),
                "planted": len(own),
                "found": sum(name in row["found"] for row in own),
            }
        )
    return table


def _confusion(rows: Sequence[Row]) -> dict[str, dict[str, int]]:
    """Count what was named first, by the effect that was concealed alone."""
    found: dict[str, Counter[str]] = {}
    for row in rows:
        found.setdefault(_known(row)[0], Counter())[row["first"]] += 1
    return {name: dict(found[name].most_common()) for name in sorted(found)}


def _reliability(stated: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return how often a finding was true, in bins of its confidence."""
    bins = []
    for low, high in pairwise(EDGES):
        inside = [entry for entry in stated if low <= entry["confidence"] < high]
        right = sum(entry["right"] for entry in inside)
        bins.append(
            {
                "from": low,
                "to": min(high, 1.0),
                "stated": float(np.mean([entry["confidence"] for entry in inside])) if inside else None,
                "right": right / len(inside) if inside else None,
                "ci95": list(wilson(right, len(inside))),
                "of": len(inside),
            }
        )
    return bins
