"""What a diagnosis is worth against the truth, the same for `reconcile` and for its peer."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from tests.blind.effects import COMMAND_ONLY

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from tests.blind.case import Case

Z = 1.96


class Said(NamedTuple):
    """A tool's answer to a case."""

    named: list[tuple[str, tuple[str, ...]]]
    """Effects, the strongest first, each with those declared to be equivalent."""
    left: dict[str, float]
    """By axis and sense: RMS on held-out blocks with the effects named, over that of the refitted model."""
    level: dict[str, float]
    """The same RMS, SI."""
    seconds: float
    failure: str = ""


class Marks(NamedTuple):
    """A case judged; None where the question does not arise."""

    first: bool | None
    """One effect, observable: the first name is its own."""
    first_or_class: bool | None
    """Or one that is declared to be equivalent."""
    whole: bool | None
    """Several: every observable one is named, or an equivalent."""
    false_name: bool
    """A name that is neither concealed nor true beside it nor clutter."""


def observable(case: Case, name: str, *, deviation: bool) -> bool:
    """Whether the recorded channels hold it at all."""
    return (case.sensing.has_scale or not deviation) and (case.sensing.is_command or name not in COMMAND_ONLY)


def judge(case: Case, said: Said) -> Marks:
    """Clutter and what is true besides is neither right nor wrong, wherever it is named."""
    planted = [p.name for p in case.planted if p.catalogue]
    wanted = [p.name for p in case.planted if p.catalogue and observable(case, p.name, deviation=p.deviation)]
    neutral = ({*case.clutter} | {name for p in case.planted for name in p.also}) - {*planted}
    counted = [(name, {name, *alike}) for name, alike in said.named if name not in neutral]
    single = case.kind == "single" and bool(wanted)
    return Marks(
        bool(counted) and counted[0][0] == wanted[0] if single else None,
        bool(counted) and wanted[0] in counted[0][1] if single else None,
        all(any(w in alike for _, alike in counted) for w in wanted)
        if case.kind == "several" and wanted
        else None,
        any(not alike & {*planted} for _, alike in counted),
    )


LINES: dict[str, tuple[Callable[[Case], bool], Callable[[Marks], bool | None], bool]] = {
    "right first name, one effect": (lambda _: True, lambda m: m.first, True),
    "the same, or a declared equivalent": (lambda _: True, lambda m: m.first_or_class, True),
    "all found, several effects": (lambda _: True, lambda m: m.whole, True),
    "a false name, any case": (lambda _: True, lambda m: m.false_name, False),
    "a false name, nothing left out": (
        lambda case: case.kind in {"none", "parameters"},
        lambda m: m.false_name,
        False,
    ),
    "a false name, physics of no catalogue": (
        lambda case: case.kind == "foreign",
        lambda m: m.false_name,
        False,
    ),
}
"""Which cases, which mark, and whether more is better."""


def summary(judged: Sequence[tuple[Case, Said, Marks]]) -> dict[str, dict[str, Any]]:
    """Every line with its count and 95 % interval (Wilson), then the held-out error and the time."""
    lines: dict[str, dict[str, Any]] = {}
    for name, (asked, mark, more) in LINES.items():
        marks = [value for case, _, m in judged if asked(case) and (value := mark(m)) is not None]
        hits = sum(marks)
        lines[name] = {
            "count": hits,
            "of": len(marks),
            "ci95": wilson(hits, len(marks)),
            "more_is_better": more,
        }
    left = [value for _, said, _ in judged for value in said.left.values()]
    seconds = [said.seconds for _, said, _ in judged]
    lines["held-out RMS over that of the refitted model, geometric mean"] = {
        "value": float(np.exp(np.mean(np.log(left)))) if left else math.nan
    }
    lines["seconds, median"] = {"value": float(np.median(seconds)) if seconds else math.nan}
    lines["failures"] = {"value": float(sum(bool(said.failure) for _, said, _ in judged))}
    return lines


def wilson(hits: int, of: int) -> tuple[float, float]:
    """95 % interval of a share."""
    if of == 0:
        return 0.0, 1.0
    middle = (hits + 0.5 * Z**2) / (of + Z**2)
    half = Z / (of + Z**2) * math.sqrt(hits * (of - hits) / of + 0.25 * Z**2)
    return max(middle - half, 0.0), min(middle + half, 1.0)
