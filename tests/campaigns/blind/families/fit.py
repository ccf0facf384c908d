"""Fits the rules on cases of some families, for leave-one-family-out scores.

Thresholds are chosen by coordinate search over short lists, until none changes. A value changes only if
`worth` rises by LEAST_RISE or more. Confidences are a logistic curve by maximum likelihood, interval widths
the smallest of a list that cover 95 % of the true values.
"""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from scipy.optimize import minimize

from tests.campaigns.blind.families.decide import GAIN_MARGIN, Rules
from tests.campaigns.blind.families.score import Row, scores_of

LISTS: dict[str, tuple[float, ...]] = {
    "least_gain": (0.1, 0.15, 0.2, 0.3, 0.4, 0.5),
    "least_confidence": (0.4, 0.6, 0.8, 0.9),
    "least_size": (0.0, 0.05, 0.1, 0.15, 0.2, 0.3),
    "least_roundings": (1.0, 1.5, 2.0, 3.0, 4.0, 6.0),
    "floors": (2.0, 3.0, 4.0, 6.0),
    "left_share": (0.05, 0.1, 0.15, 0.2, 0.25, 0.35, 0.5),
    "far_floors": (6.0, 10.0, 20.0, 40.0),
    "far_share": (0.03, 0.05, 0.1, 0.2),
    "strength": (15.0, 20.0, 25.0, 30.0, 40.0, 60.0, 100.0),
}
RATIOS = (1.0, 2.0, 4.0, 8.0)
WIDTHS = (1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0)
COVERAGE = 0.95
ROUNDS = 5
LEAST_RISE = 2
"""Least rise of `worth` for a change: one case may be chance."""
PRIOR = 0.05
"""Weight of the squared difference between the curve of confidences and its start."""


def worth(scores: Iterable[Row]) -> int:
    """Return right answers less wrong ones: single names, sets of all, unknowns; false names and alarms."""
    total = 0
    for row in scores:
        if "error" in row:
            continue
        right = row["right"].values()
        total += bool(row["right"]) and row["kind"] in {"single", "several"} and all(right)
        total += row["foreign_observable"] and row["unknown"]
        total -= bool(row["false"])
        total -= row["kind"] == "quiet" and row["unknown"]
    return total


def fitted(rows: list[Row], start_rules: Rules) -> Rules:
    """Return the rules fitted to these training cases, from the engine's own rules as a start."""
    rules = thresholds(rows, start_rules)
    rules = rules._replace(common_ratio=_ratio(rows, rules))
    scores = scores_of(rows, rules)
    rules = rules._replace(width=_width(rows, rules))
    intercept, slope = _curve(rows, scores, start_rules)
    return rules._replace(intercept=intercept, slope=slope)


def thresholds(rows: list[Row], start_rules: Rules) -> Rules:
    """Return the rules with the thresholds of the largest worth."""
    rules, best = start_rules, worth(scores_of(rows, start_rules))
    for _ in range(ROUNDS):
        before = rules
        for name, values in LISTS.items():
            for value in sorted(values, key=lambda one: abs(one - getattr(start_rules, name))):
                tried = rules._replace(**{name: value})
                total = worth(scores_of(rows, tried))
                if total >= best + LEAST_RISE:
                    rules, best = tried, total
        if rules == before:
            break
    return rules


def _ratio(rows: list[Row], rules: Rules) -> float:
    def firsts(ratio: float) -> int:
        return sum(row.get("first", False) for row in scores_of(rows, rules._replace(common_ratio=ratio)))

    return max(RATIOS, key=lambda ratio: (firsts(ratio), -abs(math.log(ratio / rules.common_ratio))))


def _width(rows: list[Row], rules: Rules) -> float:
    for width in WIDTHS:
        held = [
            one
            for row in scores_of(rows, rules._replace(width=width))
            for one in row.get("covered", {}).values()
        ]
        if not held or sum(held) >= COVERAGE * len(held):
            return width
    return WIDTHS[-1]


def _curve(rows: list[Row], scores: list[Row], start_rules: Rules) -> tuple[float, float]:
    """Return intercept and slope of the log odds of a true name."""
    names = [
        (one["heldout_gain"], 1.0 - one["best_rival"], one["effect"] not in score["false"])
        for row, score in zip(rows, scores, strict=True)
        for one in row.get("evidence", {"findings": []})["findings"]
        if one["effect"] != "unknown"
        and any(one["effect"] == finding["effect"] for finding in score["findings"])
    ]
    if not names:
        return start_rules.intercept, start_rules.slope
    gain, alone, right = np.array(names, dtype=np.float64).T
    gain = np.clip(gain, GAIN_MARGIN, 1.0 - GAIN_MARGIN)
    odds, start = np.log(gain / (1.0 - gain)), np.array([start_rules.intercept, start_rules.slope])

    def cost(curve: Any) -> float:
        p = np.clip(alone / (1.0 + np.exp(-curve[0] - curve[1] * odds)), 1e-6, 1.0 - 1e-6)
        likelihood = (right * np.log(p) + (1.0 - right) * np.log1p(-p)).sum()
        return float(PRIOR * ((curve - start) ** 2).sum() - likelihood)

    intercept, slope = minimize(cost, start, method="Nelder-Mead").x
    return round(float(intercept), 2), round(max(float(slope), 0.0), 2)
