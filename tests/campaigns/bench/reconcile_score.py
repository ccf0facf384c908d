"""What two tools' answers to concealed cases are worth: each scored as in the blind trials, then counted."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from reconcile.trials.score import score
from reconcile.trials.summary import wilson

Row = Mapping[str, Any]

SOUND = ("none", "parameters")


class ToolAnswer(NamedTuple):
    """A tool's answer to a case."""

    verdict: str
    findings: list[dict[str, Any]]
    """As in verdict.json, the strongest first."""
    left: dict[str, float]
    """By axis and sense: RMS on held-out blocks with the effects, over that of the refitted model."""
    level: dict[str, float]
    """The same RMS, SI."""
    seconds: float
    failure: str = ""


def finding(axis: str, effect: str, equivalent: Sequence[str], share: float) -> dict[str, Any]:
    """As much of a finding as is scored, from a tool that states no confidence and no parameters."""
    return {
        "axis": axis,
        "effect": effect,
        "equivalent": [*equivalent],
        "confidence": 1.0,
        "heldout_gain": share,
        "parameters": {},
    }


def judge(truth: Row, answer: ToolAnswer) -> dict[str, Any]:
    """The blind trials' row of a case; parameters are left aside, for the peer states none."""
    bare = {**truth, "effects": [{**effect, "parameters": {}} for effect in truth["effects"]]}
    row = score(bare, {"verdict": answer.verdict, "findings": answer.findings})
    return {key: row[key] for key in ("kind", "planted", "first", "found", "false", "called_unknown")}


def _known(row: Row) -> list[str]:
    return [effect["name"] for effect in row["planted"] if effect["catalogue"] and effect["observable"]]


def _one(row: Row) -> bool:
    return row["kind"] == "single" and bool(_known(row))


LINES: dict[str, tuple[Callable[[Row], bool], Callable[[Row], bool]]] = {
    "first name right, one effect": (_one, lambda row: row["first"] == "right"),
    "first name right or of its class": (_one, lambda row: row["first"] in {"right", "class"}),
    "found at all, one effect": (_one, lambda row: len(row["found"]) == 1),
    "all found, several effects": (
        lambda row: row["kind"] == "several" and bool(_known(row)),
        lambda row: len(row["found"]) == len(_known(row)),
    ),
    "a false name, any case": (lambda _: True, lambda row: bool(row["false"])),
    "a false name, nothing left out": (lambda row: row["kind"] in SOUND, lambda row: bool(row["false"])),
    "a false name, physics of no catalogue": (
        lambda row: row["kind"] == "foreign",
        lambda row: bool(row["false"]),
    ),
    "called unknown, physics of no catalogue": (
        lambda row: row["kind"] == "foreign",
        lambda row: bool(row["called_unknown"]),
    ),
}
"""Which cases are asked, and what is counted. All effects are the observable ones."""


def summary(answers: Sequence[tuple[Row, ToolAnswer]]) -> dict[str, dict[str, Any]]:
    """Every line with its count and 95 % interval (Wilson), then the held-out error and the time."""
    lines: dict[str, dict[str, Any]] = {}
    for name, (asked, counted) in LINES.items():
        marks = [counted(row) for row, _ in answers if asked(row)]
        hits = sum(marks)
        lines[name] = {"count": hits, "of": len(marks), "ci95": wilson(hits, len(marks))}
    lines["false names a case"] = {"value": _mean([len(row["false"]) for row, _ in answers])}
    left = [math.log(value) for _, answer in answers for value in answer.left.values()]
    lines["held-out RMS over the refitted model's, geometric mean"] = {"value": math.exp(_mean(left))}
    seconds = [answer.seconds for _, answer in answers if not answer.failure]
    lines["seconds a case, median"] = {"value": float(np.median(seconds)) if seconds else math.nan}
    lines["failures"] = {"value": float(sum(bool(answer.failure) for _, answer in answers))}
    return lines


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values) if values else math.nan
