"""The rivals on the families' cases as tables: PySINDy by the rule that fits ours, boosting, rollouts."""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from tests.campaigns.blind.families.fit import worth
from tests.campaigns.blind.families.score import Row, scored, summary

Answers = dict[tuple[str, int], Row]
"""Answers by family and seed."""


class SindyRules(NamedTuple):
    """What no data of a case can tell PySINDy's user; the first of each list where nothing tells."""

    complexity: float = 0.005
    least_share: float = 0.1
    left_share: float = math.inf
    """Share of the squares of the refitted force left on the choosing blocks from which on it is unknown."""


COMPLEXITIES = (0.001, 0.0025, 0.005, 0.01, 0.02, 0.04, 0.08)
LEAST_SHARES = (0.02, 0.05, 0.1, 0.2, 0.3)
LEFT_SHARES = (0.1, 0.2, 0.35, 0.5, 0.7, 0.9, math.inf)
LINES = {
    "right_of_single": "one effect, observable: its name or declared class",
    "first_of_single": "the same, before all other names",
    "all_of_several": "two or three effects: all observable ones named",
    "false_names_quiet_and_foreign": "quiet or foreign: a false name",
    "false_names_beside_true": "others: a false name",
    "unknown_of_foreign": "observable foreign physics: called unknown",
    "unknown_of_quiet": "quiet: called unknown",
    "unexplained_within_factor": "unexplained share told within a factor of 1.5",
}
GAIN, LEAST_POSSIBLE, ENOUGH = 0.90, 0.05, 20
"""Bar of the gain; share of the held-out variance below which there is nothing to gain; counts a family."""
LESS_IS_GOOD = {"false_names_quiet_and_foreign", "false_names_beside_true", "unknown_of_quiet"}


def sindy_score(row: Row, answer: Row, rules: SindyRules) -> Row:
    """Score PySINDy's answer to a case by the rule that scores ours."""
    own = next(one for one in answer["pysindy"] if rules.complexity in one["complexities"])
    findings = [
        {"effect": effect, "equivalent": alike, "confidence": 1.0, "parameters": {}}
        for effect, share, alike in own["named"]
        if share >= rules.least_share
    ]
    refitted, after = own["held_out"]["force"]
    if after**2 >= rules.left_share * refitted**2:
        findings.append({"effect": "unknown", "equivalent": [], "confidence": 1.0, "parameters": {}})
    rest = {"x": {"force": {"parts": {"unexplained": {"rms": after}}}}}
    word = "effects" if findings else "consistent"
    return scored(row["truth"], {"verdict": word, "findings": findings, "accounted": rest})


def tuned(rows: Sequence[Row], answers: Answers) -> SindyRules:
    """Return the rules of most worth on these rows; of equals those nearest to the ones of old."""
    begun = SindyRules()
    asked = [row for row in rows if (row["family"], row["seed"]) in answers and "error" not in row]

    def value(rules: SindyRules) -> tuple[int, int]:
        total = worth(sindy_score(row, answers[row["family"], row["seed"]], rules) for row in asked)
        return total, sum(a == b for a, b in zip(rules, begun, strict=True))

    grid = itertools.product(COMPLEXITIES, LEAST_SHARES, LEFT_SHARES)
    return max((SindyRules(*one) for one in grid), key=value)


def section(
    rows: Sequence[Row], training: Sequence[Row], ours: Sequence[Row], found: Sequence[Row]
) -> Iterator[str]:
    """Yield the tables; `ours` are our scores of `rows`, `found` the rivals' answers."""
    answers = {(one["family"], one["seed"]): one for one in found}
    asked = [row for row in rows if (row["family"], row["seed"]) in answers and "error" not in row]
    if not asked:
        return
    families = sorted({row["family"] for row in asked})
    rules = {name: tuned([row for row in training if row["family"] != name], answers) for name in families}
    theirs = [sindy_score(row, answers[row["family"], row["seed"]], rules[row["family"]]) for row in asked]
    keys = {(row["family"], row["seed"]) for row in asked}
    same = [one for one in ours if (one["family"], one["seed"]) in keys]
    trained = sum((row["family"], row["seed"]) in answers for row in training)
    yield (
        f"{len(asked)} of these cases went to PySINDy too; its rules were fitted on {trained} training "
        "cases, each family left out:"
    )
    yield ""
    yield from _lines(summary(same), summary(theirs), families)
    text = ", ".join(
        f"{name} {one.complexity:g}/{one.least_share:g}/{one.left_share:g}" for name, one in rules.items()
    )
    yield f"PySINDy's complexity, least share and share left to be unknown: {text}."
    yield ""
    yield from _gains(asked, answers, families)
    yield from _fits(asked, answers, rules, families)
    yield from _parameters(asked, answers, families)


def _lines(ours: Row, theirs: Row, families: Sequence[str]) -> Iterator[str]:
    yield "| score | ours | PySINDy | ours, worst | PySINDy, worst | |"
    yield "| --- | --- | --- | --- | --- | --- |"
    for name, title in LINES.items():
        both = [[of[family][name] for family in families if of[family][name]["of"]] for of in (ours, theirs)]
        if not both[0] or not both[1]:
            continue
        pooled = [sum(one["share"] * one["of"] for one in of) for of in both]
        counts = [sum(one["of"] for one in of) for of in both]
        worst = [(max if name in LESS_IS_GOOD else min)(one["share"] for one in of) for of in both]
        a, b = (value / count for value, count in zip(pooled, counts, strict=True))
        better = a < b if name in LESS_IS_GOOD else a > b
        word = "level" if a == b else "above" if better else "**below**"
        cells = " | ".join(f"{round(v)} of {n}" for v, n in zip(pooled, counts, strict=True))
        yield f"| {title} | {cells} | {worst[0]:.2f} | {worst[1]:.2f} | {word} |"
    yield ""


def _median(values: Sequence[float], digits: int = 2) -> str:
    return f"{float(np.median(values)):.{digits}f}" if values else "-"


def _gains(rows: Sequence[Row], answers: Answers, families: Sequence[str]) -> Iterator[str]:
    """Yield the share of the achievable held-out gain: the floor is what is left with nothing concealed."""
    of_family: dict[str, list[float]] = {family: [] for family in families}
    for row in rows:
        for channel, (before, floor) in answers[row["family"], row["seed"]].get("achievable", {}).items():
            [fit] = row["evidence"]["fit"].values()
            possible = before**2 - floor**2
            if possible > LEAST_POSSIBLE * before**2:
                gained = before**2 - fit[channel]["after"]["heldout"] ** 2
                of_family[row["family"]].append(gained / possible)
    counted = {family: of for family, of in of_family.items() if of}
    if not counted:
        return
    worst = min(float(np.median(of)) for of in counted.values())
    enough = all(len(of) >= ENOUGH for of in of_family.values())
    word = "**missed**" if worst < GAIN else "met" if enough else "within, too few to say"
    yield (
        "Share of the achievable held-out gain, one to three effects and no foreign physics, median over "
        f"channels; bar {GAIN}, worst {worst:.2f}: {word}."
    )
    yield ""
    yield "| | " + " | ".join(families) + " |"
    yield "| --- |" + " --- |" * len(families)
    yield "| median | " + " | ".join(_median(of_family[family]) for family in families) + " |"
    yield "| channels | " + " | ".join(str(len(of_family[family])) for family in families) + " |"
    yield ""


def _fits(
    rows: Sequence[Row], answers: Answers, rules: Mapping[str, SindyRules], families: Sequence[str]
) -> Iterator[str]:
    """Yield what each leaves of the force that a rigid model leaves, on blocks it was not fitted on."""

    def ours(row: Row) -> float:
        [fit] = [of["force"] for of in row["evidence"]["fit"].values()]
        return float(fit["after"]["heldout"] / fit["refitted"]["heldout"])

    def sindy(row: Row) -> float:
        complexity = rules[row["family"]].complexity
        answer = answers[row["family"], row["seed"]]["pysindy"]
        refitted, after = next(one for one in answer if complexity in one["complexities"])["held_out"][
            "force"
        ]
        return float(after / refitted)

    def boosting(row: Row) -> float:
        answer = answers[row["family"], row["seed"]]["boosting"]
        return float(answer["after"] / answer["refitted"])

    yield (
        "Held-out RMS of the force over that of a refitted rigid model, median; each on what it holds out "
        "itself:"
    )
    yield ""
    yield "| tool | " + " | ".join(families) + " |"
    yield "| --- |" + " --- |" * len(families)
    tools = {"reconcile": ours, "PySINDy": sindy, "gradient boosting": boosting}
    for name, of in tools.items():
        cells = [_median([of(row) for row in rows if row["family"] == family]) for family in families]
        yield f"| {name} | " + " | ".join(cells) + " |"
    for coordinate in answers[rows[0]["family"], rows[0]["seed"]]["boosting"]["shapley"]:
        cells = [
            _median(
                [
                    answers[row["family"], row["seed"]]["boosting"]["shapley"][coordinate]
                    for row in rows
                    if row["family"] == family
                ]
            )
            for family in families
        ]
        yield f"| boosting explains by {coordinate} (Shapley, share of squares) | " + " | ".join(cells) + " |"
    yield ""


def _parameters(rows: Sequence[Row], answers: Answers, families: Sequence[str]) -> Iterator[str]:
    """Yield the median relative errors of what the nominal model has."""

    def ours(row: Row, place: int) -> float:
        [fit] = [of["force"] for of in row["evidence"]["fit"].values()]
        return float([*fit["values"].values()][place])

    yield "Relative error of the nominal model's own parameters, median:"
    yield ""
    yield "| parameter, tool | " + " | ".join(families) + " |"
    yield "| --- |" + " --- |" * len(families)
    for place, name in enumerate(("inertia", "viscous", "coulomb")):
        for tool in ("reconcile", "rollouts"):
            cells = []
            for family in families:
                errors = []
                for row in rows:
                    if row["family"] != family:
                        continue
                    answer = answers[family, row["seed"]]
                    value = ours(row, place) if tool == "reconcile" else answer["rollouts"][name]
                    errors.append(abs(value / answer["sound"][name] - 1.0))
                cells.append(_median(errors, 3))
            yield f"| {name}, {tool} | " + " | ".join(cells) + " |"
    yield ""
