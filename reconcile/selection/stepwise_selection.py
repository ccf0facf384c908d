"""Stepwise selection of terms by cross-validated squares: forward steps, backward elimination, exchange.

A term is added if it is accepted (`acceptance`) and improves the cross-validated prediction most. After each
step the earlier terms must still be needed, and at the end each must be better than any rival in its place.
Source: Draper and Smith (1998), section 15.2, with cross-validation in place of the F test.
"""

from collections.abc import Container, Iterable, Sequence

from kernels.arrays import Array
from reconcile.catalogue.registry import ADDITIVE, IMITATED_BY_PRESLIDING, TIMING, possible
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.regression.regression_problem import SINCE_REVERSAL
from reconcile.selection.acceptance import CLEARLY_BETTER_T, SelectionContext, is_accepted
from reconcile.selection.block_statistics import log_ratio_t
from reconcile.selection.cross_validation import CrossValidation
from reconcile.selection.selection_rules import SelectionRules
from reconcile.selection.shortlist import Shortlist, simplest_of_ties

LARGEST_SET = 6
"""Terms of one effect that are added in one step: bounds the time of a search; chosen."""


def select(
    validation: CrossValidation,
    rules: SelectionRules,
    excluded: Container[str] = (),
    given: Sequence[CandidateTerm] = (),
    sampling_s: float = 0.0,
) -> list[CandidateTerm]:
    """Select terms beside `given` ones, none of `excluded` effects; timing before physics.

    `sampling_s`: cycle of the recordings. Where no timing is significant, a delay within it may be.
    """
    context = _context(validation, rules, [], excluded, given)
    timing_terms = [c for c in context.named_terms if c.effect in TIMING]
    timing = _select_forward(context._replace(named_terms=timing_terms), [*given])
    if len(timing) == len(given):
        context = context._replace(sampling_s=sampling_s)
        timing = _select_forward(context._replace(named_terms=timing_terms), [*given])
    context = context._replace(initial_squares=initial_squares(validation, timing))
    return _exchange_with_rivals(context, _select_forward(context, timing))


def select_beside_unnamed(
    validation: CrossValidation,
    rules: SelectionRules,
    previous: Sequence[CandidateTerm],
    unnamed: Sequence[CandidateTerm],
    excluded: Container[str] = (),
    given: Sequence[CandidateTerm] = (),
    sampling_s: float = 0.0,
) -> list[CandidateTerm]:
    """Select again beside `unnamed` terms, from the `previous` selection, of which the `given` terms stay.

    Terms that presliding can imitate must be accepted again, and none of these is added.
    """
    context = _context(validation, rules, unnamed, excluded, given)._replace(
        initial_squares=initial_squares(validation, previous), sampling_s=sampling_s
    )
    chosen = [*previous, *unnamed]
    for term in (c for c in previous if c.effect in IMITATED_BY_PRESLIDING):
        if not _is_still_accepted(context, chosen, term):
            chosen = _without(chosen, term)
    not_imitated = [c for c in context.named_terms if c.effect not in IMITATED_BY_PRESLIDING]
    return _select_forward(context._replace(named_terms=not_imitated), chosen)


def initial_squares(validation: CrossValidation, chosen: Sequence[CandidateTerm]) -> float:
    """Cross-validated squares of the model that has only the timing terms among the `chosen` ones."""
    return float(validation.cross_validated_squares([c for c in chosen if c.effect in TIMING]).sum())


def _context(
    validation: CrossValidation,
    rules: SelectionRules,
    unnamed: Sequence[CandidateTerm],
    excluded: Container[str],
    given: Sequence[CandidateTerm],
) -> SelectionContext:
    candidates = validation.equations.candidates
    named_terms = [c for c in candidates if not c.effect.startswith(PREFIX) and c.effect not in excluded]
    since_reversal_terms = [c for c in candidates if c.effect == SINCE_REVERSAL and c not in unnamed]
    squares = float(validation.cross_validated_squares([]).sum())
    return SelectionContext(validation, rules, named_terms, squares, since_reversal_terms, given)


def _select_forward(context: SelectionContext, chosen: list[CandidateTerm]) -> list[CandidateTerm]:
    """Add the best accepted term or else an additive set, then eliminate, until nothing is accepted."""
    tried = {frozenset(chosen)}
    rejected: set[CandidateTerm] = set()
    while len(chosen) < context.rules.most_terms:
        squares_without = context.validation.cross_validated_squares(chosen)
        candidates = [c for c in _admissible(context.named_terms, chosen) if c not in rejected]
        shortlist = Shortlist(context, chosen, squares_without, candidates)
        best = next(shortlist.accepted(), None)
        if best is None:
            added = _additive_set(context, chosen, squares_without, rejected)
        else:
            added = [simplest_of_ties(shortlist, best)]
        if not added:
            break
        extended = _eliminate_backward(context, [*chosen, *added])
        if frozenset(extended) in tried:  # a cycle: these terms eliminate those that led to them
            rejected |= set(added)
            continue
        chosen = extended
        tried.add(frozenset(chosen))
    return chosen


def _additive_set(
    context: SelectionContext,
    chosen: list[CandidateTerm],
    squares_without: Array,
    rejected: Container[CandidateTerm],
) -> list[CandidateTerm]:
    """The best set of terms of one effect that is accepted only as a whole: each alone harms some blocks."""
    validation, rules = context.validation, context.rules
    by_effect: dict[tuple[str, bool], list[CandidateTerm]] = {}
    for c in context.named_terms:
        if c.effect in ADDITIVE and c not in chosen and c not in rejected:
            by_effect.setdefault((c.effect, c.per_recording), []).append(c)
    best: list[CandidateTerm] = []
    largest_gain = rules.least_set_gain
    for candidates in by_effect.values():
        terms = _greedy_set(validation, chosen, candidates, rules.least_set_gain)
        if len(terms) < 2:
            continue
        score = validation.score_last([*chosen, *terms], squares_without, len(terms))
        # the number of sets that could have been formed
        possible_sets = len(context.named_terms) * len(candidates) ** (len(terms) - 1)
        if score.gain > largest_gain and score.is_significant(possible_sets, rules.false_alarm):
            best, largest_gain = terms, score.gain
    return best


def _greedy_set(
    validation: CrossValidation,
    chosen: Sequence[CandidateTerm],
    candidates: Sequence[CandidateTerm],
    least_gain: float,
) -> list[CandidateTerm]:
    """Candidates added one by one, the best first, while a plain fit gains the share of its residual."""
    terms: list[CandidateTerm] = []
    explained = validation.explained_squares(chosen)
    while len(terms) < min(LARGEST_SET, len(candidates)):
        scores = {c: validation.explained_squares([*chosen, *terms, c]) for c in candidates if c not in terms}
        best = max(scores, key=lambda c: scores[c])
        if scores[best] - explained < least_gain * (validation.target_squares - explained):
            break
        terms, explained = [*terms, best], scores[best]
    return terms


def _eliminate_backward(context: SelectionContext, chosen: list[CandidateTerm]) -> list[CandidateTerm]:
    """Drop earlier terms that are no longer accepted beside the others."""
    chosen = _drop_impossible(context, chosen)
    for term in chosen[:-1]:
        if term.effect.startswith(PREFIX) or term in context.given:
            continue
        others = _without(chosen, term)
        if term.effect in ADDITIVE and any(c.effect == term.effect for c in others):
            continue  # part of an additive set
        if not _is_still_accepted(context, chosen, term):
            chosen = others
    return chosen


def _is_still_accepted(
    context: SelectionContext, chosen: Sequence[CandidateTerm], term: CandidateTerm
) -> bool:
    """Whether a chosen term is accepted beside the others."""
    others, validation = _without(chosen, term), context.validation
    squares_without = validation.cross_validated_squares(others)
    return is_accepted(context, others, validation.score(others, squares_without, term), squares_without)


def _drop_impossible(context: SelectionContext, chosen: list[CandidateTerm]) -> list[CandidateTerm]:
    """Drop terms whose coefficients became physically impossible beside the others."""
    for term in (c for c in chosen if c not in context.given):
        others = _without(chosen, term)
        coefficients = context.validation.coefficients([*others, term])[-len(term.columns) :]
        if not possible(term.effect, coefficients):
            chosen = others
    return chosen


def _exchange_with_rivals(context: SelectionContext, chosen: list[CandidateTerm]) -> list[CandidateTerm]:
    """Replace each term by a clearly better term of another effect, if there is one."""
    validation = context.validation
    for index, term in enumerate(chosen):
        if term.effect.startswith(PREFIX) or term in context.given:
            continue
        others = _without(chosen, term)
        squares_without = validation.cross_validated_squares(others)
        score = validation.score(others, squares_without, term)
        rivals = [c for c in _admissible(context.named_terms, others) if c.effect != term.effect]
        shortlist = Shortlist(context, others, squares_without, rivals)
        clearly_better = (
            rival
            for rival in shortlist.accepted(gain_above=score.gain)
            if log_ratio_t(rival.squares, score.squares) > CLEARLY_BETTER_T
        )
        simplest = simplest_of_ties(shortlist, next(clearly_better, score))
        chosen = [*chosen[:index], simplest, *chosen[index + 1 :]]
    return chosen


def _without(chosen: Sequence[CandidateTerm], term: CandidateTerm) -> list[CandidateTerm]:
    return [c for c in chosen if c != term]


def _admissible(named_terms: Iterable[CandidateTerm], chosen: Sequence[CandidateTerm]) -> list[CandidateTerm]:
    """Candidates not excluded by a chosen term: one per effect unless additive, and one of timing."""
    excluded = {c.effect for c in chosen} - ADDITIVE
    if excluded & TIMING:
        excluded |= TIMING
    return [c for c in named_terms if c not in chosen and c.effect not in excluded]
