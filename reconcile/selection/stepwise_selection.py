"""Stepwise selection of terms by cross-validated squares: forward steps, backward elimination, exchange.

A term is added if it is accepted (`acceptance`) and improves the cross-validated prediction most. After each
step the earlier terms must still be needed, and at the end each must be better than any rival in its place.
Source: Draper and Smith (1998), section 15.2, with cross-validation in place of the F test.
"""

import math
from collections.abc import Container, Iterable, Iterator, Sequence

from kernels.arrays import Array
from reconcile.catalogue.registry import ADDITIVE, IMITATED_BY_PRESLIDING, TIMING, possible
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.regression.regression_problem import SINCE_REVERSAL
from reconcile.selection.acceptance import CLEARLY_BETTER, SelectionContext, accepted
from reconcile.selection.block_statistics import paired
from reconcile.selection.cross_validation import SHORTLIST, CrossValidation, Score, SelectionRules

LARGEST_SET = 6
"""Terms of one effect that are added in one step."""
TIED_GAIN_RATIO = 0.97
"""Least gain of a term that is tied with the best one, as a share of the best gain."""


def select(
    validation: CrossValidation, rules: SelectionRules, excluded: Container[str] = ()
) -> list[CandidateTerm]:
    """Select terms but for `excluded` effects, in the order of their addition; timing, no physics, first."""
    context = _context(validation, rules, [], excluded)
    timing_terms = [c for c in context.named_terms if c.effect in TIMING]
    timing = _select_forward(context._replace(named_terms=timing_terms), [])
    context = context._replace(initial=initial_squares(validation, timing))
    return _exchange_with_rivals(context, _select_forward(context, timing))


def select_beside_unnamed(
    validation: CrossValidation,
    rules: SelectionRules,
    previous: Sequence[CandidateTerm],
    unnamed: Sequence[CandidateTerm],
    excluded: Container[str] = (),
) -> list[CandidateTerm]:
    """Select again beside `unnamed` terms, from the `previous` selection.

    Terms that presliding can imitate must be accepted again, and none of these is added.
    """
    context = _context(validation, rules, unnamed, excluded)._replace(
        initial=initial_squares(validation, previous)
    )
    chosen = [*previous, *unnamed]
    for candidate in (c for c in previous if c.effect in IMITATED_BY_PRESLIDING):
        others = [c for c in chosen if c != candidate]
        before = validation.cross_validated_squares(others)
        if not accepted(context, others, validation.score(others, before, candidate), before):
            chosen = others
    not_imitated = [c for c in context.named_terms if c.effect not in IMITATED_BY_PRESLIDING]
    return _select_forward(context._replace(named_terms=not_imitated), chosen)


def initial_squares(validation: CrossValidation, chosen: Sequence[CandidateTerm]) -> float:
    """Cross-validated squares of the model with no `chosen` terms but those of timing."""
    return float(validation.cross_validated_squares([c for c in chosen if c.effect in TIMING]).sum())


def _context(
    validation: CrossValidation,
    rules: SelectionRules,
    unnamed: Sequence[CandidateTerm],
    excluded: Container[str],
) -> SelectionContext:
    candidates = validation.equations.candidates
    named_terms = [c for c in candidates if not c.effect.startswith(PREFIX) and c.effect not in excluded]
    since_reversal_terms = [c for c in candidates if c.effect == SINCE_REVERSAL and c not in unnamed]
    initial = float(validation.cross_validated_squares([]).sum())
    return SelectionContext(validation, rules, named_terms, initial, since_reversal_terms)


def _select_forward(context: SelectionContext, chosen: list[CandidateTerm]) -> list[CandidateTerm]:
    """Add the best accepted term or else an additive set, then eliminate, until nothing is accepted."""
    tried = {frozenset(chosen)}
    rejected: set[CandidateTerm] = set()
    while len(chosen) < context.rules.most_effects:
        before = context.validation.cross_validated_squares(chosen)
        free = [c for c in _admissible(context.named_terms, chosen) if c not in rejected]
        shortlist = _Shortlist(context, chosen, before, free)
        best = next(shortlist.accepted(), None)
        if best is None:
            more = _additive_set(context, chosen, before, rejected)
        else:
            more = [_simplest_of_ties(shortlist, best)]
        if not more:
            break
        extended = _eliminate_backward(context, [*chosen, *more])
        if frozenset(extended) in tried:  # a cycle: these terms eliminate those that led to them
            rejected |= set(more)
            continue
        chosen = extended
        tried.add(frozenset(chosen))
    return chosen


class _Shortlist:
    """The candidates that explain most by a plain fit; each is cross-validated once it is asked for."""

    def __init__(
        self,
        context: SelectionContext,
        chosen: list[CandidateTerm],
        before: Array,
        candidates: Sequence[CandidateTerm],
    ) -> None:
        self.context, self._chosen, self._before = context, chosen, before
        validation = context.validation
        explained = {candidate: validation.explained([*chosen, candidate]) for candidate in candidates}
        best = sorted(candidates, key=lambda candidate: explained[candidate], reverse=True)[:SHORTLIST]
        gains = [(validation.gain([*chosen, candidate], before), candidate) for candidate in best]
        # a smaller gain is never accepted, so its blocks are not evaluated
        enough = [one for one in gains if one[0] >= context.rules.least_gain]
        self._by_gain = sorted(enough, key=lambda one: one[0], reverse=True)
        self._accepted: dict[CandidateTerm, Score | None] = {}

    def accepted(
        self, least: float = -math.inf, fewer_than: float = math.inf, *, above: float = -math.inf
    ) -> Iterator[Score]:
        """Scores of those accepted, best first, from a gain on and with fewer coefficients than given."""
        validation = self.context.validation
        for gain, candidate in self._by_gain:
            if gain < least or gain <= above or validation.equations.coefficients(candidate) >= fewer_than:
                continue
            if candidate not in self._accepted:
                score = validation.score(self._chosen, self._before, candidate)
                is_accepted = accepted(self.context, self._chosen, score, self._before)
                self._accepted[candidate] = score if is_accepted else None
            if score_of := self._accepted[candidate]:
                yield score_of


def _simplest_of_ties(shortlist: _Shortlist, best: Score) -> CandidateTerm:
    """The term with the fewest coefficients among those tied with the best."""
    coefficients = shortlist.context.validation.equations.coefficients
    tied = [
        score.candidate
        for score in shortlist.accepted(TIED_GAIN_RATIO * best.gain, coefficients(best.candidate))
        if paired(best.squares, score.squares) < CLEARLY_BETTER
    ]
    return min([best.candidate, *tied], key=coefficients)


def _additive_set(
    context: SelectionContext, chosen: list[CandidateTerm], before: Array, rejected: Container[CandidateTerm]
) -> list[CandidateTerm]:
    """Set of terms of one effect that is accepted as a whole: alone, each harms some blocks."""
    validation, rules = context.validation, context.rules
    kinds: dict[tuple[str, bool], list[CandidateTerm]] = {}
    for c in context.named_terms:
        if c.effect in ADDITIVE and c not in chosen and c not in rejected:
            kinds.setdefault((c.effect, c.per_recording), []).append(c)
    best: list[CandidateTerm] = []
    largest_gain = rules.least_set_gain
    for kind in kinds.values():
        found: list[CandidateTerm] = []
        own_score, whole = validation.explained(chosen), validation.size
        while len(found) < min(LARGEST_SET, len(kind)):
            remaining = [c for c in kind if c not in found]
            c = max(remaining, key=lambda c: validation.explained([*chosen, *found, c]))
            explained = validation.explained([*chosen, *found, c])
            if explained - own_score < rules.least_set_gain * (whole - own_score):
                break
            found, own_score = [*found, c], explained
        if len(found) < 2:
            continue
        score = validation.compare([*chosen, *found], before, len(found))
        # the number of sets that could have been formed
        possible_sets = len(context.named_terms) * len(kind) ** (len(found) - 1)
        if score.gain > largest_gain and score.beyond_chance(possible_sets, rules.false_alarm):
            best, largest_gain = found, score.gain
    return best


def _eliminate_backward(context: SelectionContext, chosen: list[CandidateTerm]) -> list[CandidateTerm]:
    """Drop earlier terms that are no longer accepted beside the others."""
    chosen = _drop_impossible(context, chosen)
    for candidate in chosen[:-1]:
        if candidate.effect.startswith(PREFIX):
            continue
        others = [c for c in chosen if c != candidate]
        before = context.validation.cross_validated_squares(others)
        if candidate.effect in ADDITIVE and any(c.effect == candidate.effect for c in others):
            continue  # part of an additive set
        if not accepted(context, others, context.validation.score(others, before, candidate), before):
            chosen = others
    return chosen


def _drop_impossible(context: SelectionContext, chosen: list[CandidateTerm]) -> list[CandidateTerm]:
    """Drop terms whose coefficients became physically impossible beside the others."""
    for candidate in chosen:
        others = [c for c in chosen if c != candidate]
        values = context.validation.coefficients([*others, candidate])[-len(candidate.columns) :]
        if not possible(candidate.effect, values):
            chosen = others
    return chosen


def _exchange_with_rivals(context: SelectionContext, chosen: list[CandidateTerm]) -> list[CandidateTerm]:
    """Replace each term by a clearly better term of another effect, if there is one."""
    validation = context.validation
    for place in range(len(chosen)):
        if chosen[place].effect.startswith(PREFIX):
            continue
        others = [c for c in chosen if c != chosen[place]]
        before = validation.cross_validated_squares(others)
        own_score = validation.score(others, before, chosen[place])
        rivals = [c for c in _admissible(context.named_terms, others) if c.effect != chosen[place].effect]
        shortlist = _Shortlist(context, others, before, rivals)
        clearly = (
            s
            for s in shortlist.accepted(above=own_score.gain)
            if paired(s.squares, own_score.squares) > CLEARLY_BETTER
        )
        simplest = _simplest_of_ties(shortlist, next(clearly, own_score))
        chosen = [*chosen[:place], simplest, *chosen[place + 1 :]]
    return chosen


def _admissible(named_terms: Iterable[CandidateTerm], chosen: Sequence[CandidateTerm]) -> list[CandidateTerm]:
    """Candidates not excluded by a chosen term: one per effect unless additive, and one of timing."""
    excluded = {c.effect for c in chosen} - ADDITIVE
    if excluded & TIMING:
        excluded |= TIMING
    return [c for c in named_terms if c not in chosen and c.effect not in excluded]
