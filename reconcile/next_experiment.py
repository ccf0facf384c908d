"""The motion that would tell what the recordings could not, by rules: what is undecided, what was never done.

Doubts are asked in this order: names that cannot be told apart; what no entry explains; names too doubtful to
be said; names whose rival would have needed a motion that was never recorded; what takes another sensor; and
last, motions that were never made, for what they might have shown.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from reconcile.findings import DOUBTFUL, LEAST_NAMED
from reconcile.next_experiment_motions import EXPERIMENTS
from reconcile.next_experiment_recorded import recorded
from reconcile.next_experiment_rules import HIDDEN, LIVES_OVER, SHOWN_BY, TOLD_APART, Rule, told_apart
from reconcile.smooth_terms import PREFIX

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from reconcile.explain import Explanation
    from reconcile.findings import Finding
    from reconcile.model_file import NominalAxis
    from reconcile.next_experiment_recorded import Recorded

UNDECIDED, UNEXPLAINED, UNSAID, UNTESTED, UNMEASURED, UNTRIED = range(6)
"""Kinds of doubt, the most pressing first."""
ALWAYS = 0.5
"""Probability of what no recording of these channels can tell."""


class Doubt(NamedTuple):
    """Something open, and what would close it."""

    kind: int
    weight: float
    axis: str
    separates: tuple[str, ...]
    why: str
    rule: Rule
    sizes: Mapping[str, float]
    """Parameters found, SI."""


def next_experiment(
    explanations: Mapping[str, Sequence[Explanation]], axes: Mapping[str, NominalAxis]
) -> dict[str, Any]:
    """`next_experiment` of verdict.json; empty where nothing is open."""
    known = {name: recorded(own, axes[name]) for name, own in explanations.items() if own}
    doubts = [doubt for name, seen in known.items() for doubt in _doubts(name, explanations[name], seen)]
    if not doubts:
        return {}
    first = min(doubts, key=lambda doubt: (doubt.kind, -doubt.weight))
    experiment = EXPERIMENTS[first.rule.experiment]
    return {
        "why": first.why,
        "separates": list(first.separates),
        "axis": first.axis,
        "motion": experiment.motion,
        **experiment.numbers(known[first.axis], first.sizes),
        "tells": first.rule.tells,
    }


def _doubts(name: str, of_axis: Sequence[Explanation], seen: Recorded) -> Iterator[Doubt]:
    for explanation in of_axis:
        for finding in explanation.findings:
            if finding.effect == "unknown":
                yield _unexplained(name, finding)
            else:
                yield from _undecided(name, finding)
                yield from _untested(name, finding, seen)
        for finding in explanation.minor:
            yield from _unsaid(name, finding)
    for experiment, hidden in HIDDEN.items():
        if not EXPERIMENTS[experiment].done(seen):
            motion, shown = EXPERIMENTS[experiment].motion, _listed(hidden)
            why = f"these recordings lack {motion}: {shown} would hardly show"
            if experiment == "scale":
                why = f"no scale was recorded: {shown} cannot show"
            yield Doubt(UNTRIED, 0.0, name, hidden, why, Rule(experiment, SHOWN_BY[hidden[0]].tells), {})


def _undecided(name: str, finding: Finding) -> Iterator[Doubt]:
    """What may as well be there."""
    rivals = {rival.effect: rival.confidence for rival in finding.rivals}
    for other in finding.equivalent:
        rule = told_apart(finding.effect, other)
        if rule is None or other.startswith(PREFIX):
            continue
        kind = UNMEASURED if EXPERIMENTS[rule.experiment].sensor else UNDECIDED
        why = f"these recordings cannot tell {_listed((finding.effect, other), 'from')}"
        yield Doubt(
            kind, rivals.get(other, ALWAYS), name, (finding.effect, other), why, rule, _sizes(finding)
        )


def _unexplained(name: str, finding: Finding) -> Doubt:
    """It is located already; only its coordinate is to change."""
    if not finding.candidates:  # it lives over no coordinate
        why = "much is left that neither the catalogue nor any coordinate explains"
        rule = Rule("speeds", "whether it comes again with the motion, and how it changes with the speed")
        return Doubt(UNEXPLAINED, 1.0, name, ("unknown",), why, rule, {})
    coordinate = finding.candidates[0].effect.removeprefix(PREFIX)
    why = f"what changes with the {_words(coordinate)} is explained by no entry of the catalogue"
    tells = f"whether it changes with the {_words(coordinate)} and nothing else"
    rule = Rule(LIVES_OVER.get(coordinate, "speeds"), tells)
    return Doubt(UNEXPLAINED, finding.heldout_gain, name, ("unknown",), why, rule, {})


def _unsaid(name: str, finding: Finding) -> Iterator[Doubt]:
    """It is worth a name, but which is not clear."""
    worth_it = finding.heldout_gain >= LEAST_NAMED and finding.confidence < DOUBTFUL
    if finding.effect == "unknown" or not worth_it or not finding.rivals:
        return
    other = max(finding.rivals, key=lambda rival: rival.confidence).effect
    rule = told_apart(finding.effect, other)
    if rule is not None:
        pair = (finding.effect, other)
        why = f"something is there, and {_listed(pair, 'or')} would explain it"
        yield Doubt(UNSAID, finding.heldout_gain, name, pair, why, rule, _sizes(finding))


def _untested(name: str, finding: Finding, seen: Recorded) -> Iterator[Doubt]:
    """What it is often mistaken for could not have shown the difference."""
    for pair, rule in TOLD_APART.items():
        experiment = EXPERIMENTS[rule.experiment]
        if finding.effect not in pair or experiment.sensor or experiment.done(seen):
            continue
        other = pair[1] if pair[0] == finding.effect else pair[0]
        why = (
            f"{_words(finding.effect)} is often mistaken for {_words(other)}, and these recordings lack "
            f"{experiment.motion}"
        )
        yield Doubt(UNTESTED, finding.heldout_gain, name, (finding.effect, other), why, rule, _sizes(finding))


def _sizes(finding: Finding) -> dict[str, float]:
    """Parameters, of several alike the first."""
    sizes: dict[str, float] = {}
    for key, estimate in finding.parameters.items():
        sizes.setdefault(key.removesuffix("_1"), abs(estimate.value))
    return sizes


def _words(name: str) -> str:
    return name.replace("_", " ").replace("stribeck", "Stribeck")


def _listed(names: Sequence[str], between: str = "and") -> str:
    return f" {between} ".join(_words(name) for name in names)
