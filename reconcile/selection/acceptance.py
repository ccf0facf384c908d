"""Acceptance of a term: large enough, significant, physically possible, and not imitated by presliding."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from reconcile.catalogue import presliding_hysteresis
from reconcile.catalogue.registry import (
    DRIFTING_COLUMNS,
    IMITATED_BY_PRESLIDING,
    SHOWS_AFTER_PRESLIDING,
    TIMING,
    possible,
)
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.selection.cross_validation import CrossValidation, Score
from reconcile.selection.selection_rules import SelectionRules

CLEARLY_BETTER_T = 2.0
"""Standard errors from which on one term is better than another: about 95 %."""
LEAST_GAIN_OF_SAMPLING = 0.1
"""Least share of the unexplained squares of a delay within a cycle. Chosen."""
PRESLIDING = presliding_hysteresis.ENTRY.name
SETTLED_PRESLIDING_RATIO = 10.0
"""Distance after which presliding is over, in lengths of the longest identified one."""


class SelectionContext(NamedTuple):
    """What every step of a selection uses."""

    validation: CrossValidation
    rules: SelectionRules
    named_terms: list[CandidateTerm]
    initial_squares: float
    """Cross-validated squares of the model without any term but timing."""
    since_reversal_terms: list[CandidateTerm]
    """Unnamed terms over the distance since the reversal; what they explain as well is presliding."""
    given: Sequence[CandidateTerm] = ()
    """Terms that stay."""
    sampling_s: float = 0.0
    """Cycle of the recordings: a shorter delay is how they were sampled."""


def is_accepted(
    context: SelectionContext, chosen: Sequence[CandidateTerm], score: Score, squares_without: Array
) -> bool:
    """Whether a scored term is accepted beside the `chosen` ones, which alone leave the given squares."""
    term, rules, validation = score.candidate, context.rules, context.validation
    # a further term of a chosen effect is compared within that effect
    is_further = any(other.effect == term.effect for other in chosen)
    compared = sum(other.effect == term.effect or not is_further for other in context.named_terms)
    if not (score.is_significant(compared, rules.false_alarm) or _is_of_sampling(context, chosen, score)):
        return False
    removed_squares = float(squares_without.sum() - score.squares.sum())
    initial_share = removed_squares / max(context.initial_squares, 1e-300)
    if score.gain < rules.least_gain or initial_share < rules.least_initial_share:
        return False
    if not possible(term.effect, validation.coefficients([*chosen, term])[-len(term.columns) :]):
        return False
    if term.effect in DRIFTING_COLUMNS and not _drifts(context, chosen, term):
        return False
    if term.effect in IMITATED_BY_PRESLIDING and context.since_reversal_terms:
        return _explains_more_than_presliding(context, chosen, term)
    return True


def _is_of_sampling(context: SelectionContext, chosen: Sequence[CandidateTerm], score: Score) -> bool:
    """Whether a term is a delay within a cycle, which every recording has and no report names.

    It shows in the few blocks with abrupt motion, too few for significance, and there it is most of the rest.
    """
    term = score.candidate
    if term.effect not in TIMING or score.gain < LEAST_GAIN_OF_SAMPLING:
        return False
    own = context.validation.coefficients([*chosen, term])[-context.validation.equations.coefficients(term) :]
    return float(np.abs(own).max()) * term.shape_parameters[0] < context.sampling_s


def _drifts(context: SelectionContext, chosen: Sequence[CandidateTerm], term: CandidateTerm) -> bool:
    """Whether friction drifts within the recordings, and does not only differ between them."""
    drifting = DRIFTING_COLUMNS[term.effect]
    with_levels = (other for other in context.named_terms if other.effect == term.effect and other.levels)
    levels = next((other._replace(columns=other.levels) for other in with_levels), None)
    if levels is None:
        return True
    beside, validation = [*chosen, levels], context.validation
    drift = term._replace(columns=term.columns[:drifting])
    score = validation.score(beside, validation.cross_validated_squares(beside), drift)
    return _is_clear_gain(score, context.rules)


def _explains_more_than_presliding(
    context: SelectionContext, chosen: Sequence[CandidateTerm], term: CandidateTerm
) -> bool:
    """Whether a term is still needed beside a friction of any form over the distance since a reversal."""
    validation = context.validation
    beside = [*chosen, *context.since_reversal_terms]
    squares_without = validation.cross_validated_squares(beside)
    scores = [validation.score(beside, squares_without, term)]
    if term.effect in SHOWS_AFTER_PRESLIDING:
        presliding_m = [other.shape_parameters[0] for other in chosen if other.effect == PRESLIDING]
        settled_m = SETTLED_PRESLIDING_RATIO * max(presliding_m, default=0.0)
        is_settled = validation.settled_travel_m > settled_m
        scores.append(validation.score_last([*beside, term], squares_without, counted=is_settled))
    return all(_is_clear_gain(score, context.rules) for score in scores)


def _is_clear_gain(score: Score, rules: SelectionRules) -> bool:
    is_clear = max(score.log_ratio_t, score.normalised_sum) >= CLEARLY_BETTER_T
    return is_clear and score.gain >= rules.least_gain
