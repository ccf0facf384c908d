"""Acceptance of a term: large enough, beyond chance, physically possible, and not imitated by presliding."""

from collections.abc import Sequence
from typing import NamedTuple

from kernels.arrays import Array
from reconcile.catalogue import presliding_hysteresis
from reconcile.catalogue.registry import (
    DRIFTING_COLUMNS,
    IMITATED_BY_PRESLIDING,
    SHOWS_AFTER_PRESLIDING,
    has_levels,
    possible,
)
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.selection.cross_validation import CrossValidation, Score, SelectionRules

CLEARLY_BETTER = 2.0
"""Standard errors (2, about 95 %) from which on one term is better than another."""
PRESLIDING = presliding_hysteresis.ENTRY.name
SETTLED_PRESLIDING_RATIO = 10.0
"""Distance after which presliding is over, in lengths of the longest identified one."""


class SelectionContext(NamedTuple):
    """What every step of a selection uses."""

    validation: CrossValidation
    rules: SelectionRules
    named_terms: list[CandidateTerm]
    initial: float
    """Cross-validated squares of the model without any term but timing."""
    since_reversal_terms: list[CandidateTerm]
    """Unnamed terms over the distance since the reversal; what they explain as well is presliding."""


def accepted(search: SelectionContext, chosen: Sequence[CandidateTerm], score: Score, before: Array) -> bool:
    """Whether a scored term is accepted beside the `chosen` ones, whose squares are `before`."""
    c, rules = score.candidate, search.rules
    share = float(before.sum() - score.squares.sum()) / max(search.initial, 1e-300)
    # a further term of a chosen effect is compared within that effect
    further = any(other.effect == c.effect for other in chosen)
    count = sum(other.effect == c.effect or not further for other in search.named_terms)
    if not score.beyond_chance(count, rules.false_alarm):
        return False
    if score.gain < rules.least_gain or share < rules.least_share:
        return False
    validation = search.validation
    if not possible(c.effect, validation.coefficients([*chosen, c])[-len(c.columns) :]):
        return False
    if c.effect in DRIFTING_COLUMNS and not _drifts(search, chosen, c):
        return False
    if c.effect in IMITATED_BY_PRESLIDING and search.since_reversal_terms:
        beside = [*chosen, *search.since_reversal_terms]
        before_beside = validation.cross_validated_squares(beside)
        own = [validation.score(beside, before_beside, c)]
        if c.effect in SHOWS_AFTER_PRESLIDING:
            presliding_m = [c.shape_parameters[0] for c in chosen if c.effect == PRESLIDING]
            among = validation.settled_travel_m > SETTLED_PRESLIDING_RATIO * max(presliding_m, default=0.0)
            own.append(validation.compare([*beside, c], before_beside, among=among))
        return all(_is_significant(score, rules) for score in own)
    return True


def _drifts(search: SelectionContext, chosen: Sequence[CandidateTerm], c: CandidateTerm) -> bool:
    """Whether friction drifts within the recordings, and does not only differ between them."""
    drifting = DRIFTING_COLUMNS[c.effect]
    whole = (o for o in search.named_terms if o.effect == c.effect and has_levels(o.effect, len(o.columns)))
    levels = next((o._replace(columns=o.columns[drifting:]) for o in whole), None)
    if levels is None:
        return True
    beside, validation = [*chosen, levels], search.validation
    drift = c._replace(columns=c.columns[:drifting])
    score = validation.score(beside, validation.cross_validated_squares(beside), drift)
    return _is_significant(score, search.rules)


def _is_significant(score: Score, rules: SelectionRules) -> bool:
    return max(score.t, score.summed) >= CLEARLY_BETTER and score.gain >= rules.least_gain
