"""What a diagnosis leaves open, as pairs of models: what is named against what may stand in its place."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from scipy.stats import norm

from reconcile.catalogue.registry import ENTRIES, hypotheses
from reconcile.findings import DOUBTFUL, LEAST_NAMED, UNDECIDED
from reconcile.next_experiment_plausible import plausible
from reconcile.next_experiment_rules import confused_with
from reconcile.selection import TIMING
from reconcile.smooth_terms import PREFIX, Splines

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from reconcile.catalogue.kinds import Scene, Sense
    from reconcile.expected_evidence import Option, Sized, Term
    from reconcile.explain import Explanation
    from reconcile.findings import Finding
    from reconcile.next_experiment_recorded import Recorded

CONTESTED, MISTAKEN, UNEXPLAINED, HIDDEN = "contested", "mistaken", "unexplained", "hidden"
OFTEN_MISTAKEN = 0.1
"""Weight of what a name is often mistaken for, whatever the blocks say."""
UNSEEN = 0.3
"""Weight of all that may be there unseen, in one sense; 1 is a name that is not decided at all."""
COORDINATES = (
    "position",
    "velocity",
    "speed_by_direction",
    "acceleration",
    "force",
    "distance_since_reversal",
)
"""Of smooth terms: those that a motion of a minute varies."""
MOST_SHAPES = 8
"""Of one effect that are weighed."""
LEAST_DOUBT = float(norm.sf(UNDECIDED))


class Question(NamedTuple):
    """Which of two is it?"""

    kind: str
    weight: float
    separates: tuple[str, ...]
    truths: tuple[Option, ...]
    """Models of the first; each is one alternative."""
    rivals: tuple[Option, ...]
    sized: Sized | None = None
    """Instead of both: something of this size, or nothing beside the model."""
    beside: Option = ()
    """The model that is not in question."""


def questions(of: Explanation, seen: Recorded) -> list[Question]:
    """Of one sense of one axis."""
    scenes = [rest.scene for rest in of.rests]
    everything = (*of.findings, *of.minor)
    terms = [(c.effect, c.shape) for f in everything for c in f.candidates]
    if of.timing is not None:
        terms.append(of.timing)
    whole: Option = tuple(dict.fromkeys(terms))
    named = {finding.effect for finding in everything}
    asked: list[Question] = []
    for finding in of.findings:
        if finding.effect == "unknown":
            asked += _unexplained(finding, whole, scenes, of.sense, seen)
        else:
            asked += _contested(finding, whole, named, scenes, of.sense)
    for finding in of.minor:
        if finding.heldout_gain >= LEAST_NAMED and finding.confidence < DOUBTFUL:
            asked += _contested(finding, whole, named, scenes, of.sense)
    lost = any(f.effect == "unknown" and not f.candidates for f in of.findings)
    return asked + _hidden(whole, named, of.sense, seen, 1.0 if lost else UNSEEN)


def _contested(
    finding: Finding, whole: Option, named: set[str], scenes: Sequence[Scene], sense: Sense
) -> Iterator[Question]:
    """Against its rivals in these recordings, and against what it is often mistaken for."""
    own = tuple((c.effect, c.shape) for c in finding.candidates)
    beside = tuple(term for term in whole if term not in own)
    weights = dict.fromkeys(confused_with(finding.effect), (MISTAKEN, OFTEN_MISTAKEN))
    weights.update(
        {r.effect: (CONTESTED, _bits(r.confidence)) for r in finding.rivals if r.confidence > LEAST_DOUBT}
    )
    mine = (own, *((term,) for term in _terms(finding.effect, scenes, sense)))
    for name, (kind, weight) in weights.items():
        if name in named or {name, finding.effect} <= set(TIMING):
            continue
        others = _terms(name, scenes, sense)
        if others:
            yield Question(
                kind,
                weight,
                (finding.effect, name),
                tuple((*beside, *one) for one in mine),
                tuple((*beside, one) for one in others),
            )


def _bits(probability: float) -> float:
    """What is not known of a choice between two; 1 where both are as likely."""
    p = min(max(probability, 1e-9), 0.5)
    return -(p * math.log2(p) + (1.0 - p) * math.log2(1.0 - p))


def _unexplained(
    finding: Finding, whole: Option, scenes: Sequence[Scene], sense: Sense, seen: Recorded
) -> Iterator[Question]:
    """Its coordinate against the others, and against what the catalogue has."""
    own = tuple((c.effect, c.shape) for c in finding.candidates)
    if not own:
        return
    beside = tuple(term for term in whole if term not in own)
    rivals: dict[str, list[Term]] = {
        PREFIX + name: [(PREFIX + name, shape) for shape in Splines(name).shapes(scenes)]
        for name in COORDINATES
    }
    for sized in plausible(seen, sense):
        rivals.setdefault(sized.term[0], []).append(sized.term)
    for name, terms in rivals.items():
        if name != own[0][0] and terms[0] not in whole:
            yield Question(
                UNEXPLAINED,
                1.0 / len(rivals),
                (own[0][0], name),
                ((*beside, *own),),
                tuple((*beside, term) for term in terms),
            )


def _hidden(whole: Option, named: set[str], sense: Sense, seen: Recorded, weight: float) -> list[Question]:
    may_be = [sized for sized in plausible(seen, sense) if sized.term[0] not in named]
    return [
        Question(HIDDEN, weight / len(may_be), (sized.term[0],), (), (), sized, whole) for sized in may_be
    ]


def _terms(effect: str, scenes: Sequence[Scene], sense: Sense) -> list[Term]:
    """Shapes in which the catalogue would look for an effect, some of them where they are many."""
    if effect not in ENTRIES:
        return []
    shapes = [shape for one in hypotheses(effect, sense)[:1] for shape in one.shapes(scenes)]
    return [(effect, shape) for shape in shapes[:: math.ceil(len(shapes) / MOST_SHAPES) or 1]]
