"""The candidates of a step of the selection: accepted ones, the best first, and the simplest of tied ones."""

import math
from collections.abc import Iterator, Sequence

from kernels.arrays import Array
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.selection.acceptance import CLEARLY_BETTER_T, SelectionContext, is_accepted
from reconcile.selection.block_statistics import log_ratio_t
from reconcile.selection.cross_validation import SHORTLIST, Score

TIED_GAIN_RATIO = 0.97
"""Least gain of a term that is tied with the best one, as a share of the best gain; chosen."""


class Shortlist:
    """The candidates that explain most by a plain fit; blocks of each are evaluated when they are needed."""

    def __init__(
        self,
        context: SelectionContext,
        chosen: list[CandidateTerm],
        squares_without: Array,
        candidates: Sequence[CandidateTerm],
    ) -> None:
        self.context, self._chosen, self._squares_without = context, chosen, squares_without
        validation = context.validation
        explained = {c: validation.explained_squares([*chosen, c]) for c in candidates}
        best = sorted(candidates, key=lambda candidate: explained[candidate], reverse=True)[:SHORTLIST]
        gains = {candidate: validation.gain([*chosen, candidate], squares_without) for candidate in best}
        # a smaller gain is never accepted, so its blocks are not evaluated
        large_enough = [candidate for candidate in best if gains[candidate] >= context.rules.least_gain]
        self._gains = gains
        self._by_gain = sorted(large_enough, key=lambda candidate: gains[candidate], reverse=True)
        self._accepted_scores: dict[CandidateTerm, Score | None] = {}

    def accepted(
        self,
        least_gain: float = -math.inf,
        fewer_coefficients_than: float = math.inf,
        *,
        gain_above: float = -math.inf,
    ) -> Iterator[Score]:
        """Scores of the accepted candidates within these bounds, the largest gain first."""
        coefficients = self.context.validation.equations.coefficients
        for candidate in self._by_gain:
            gain = self._gains[candidate]
            if gain < least_gain or gain <= gain_above or coefficients(candidate) >= fewer_coefficients_than:
                continue
            if score := self._accepted_score(candidate):
                yield score

    def _accepted_score(self, candidate: CandidateTerm) -> Score | None:
        """The score of an accepted candidate, None of another; computed once."""
        if candidate not in self._accepted_scores:
            score = self.context.validation.score(self._chosen, self._squares_without, candidate)
            accepted = is_accepted(self.context, self._chosen, score, self._squares_without)
            self._accepted_scores[candidate] = score if accepted else None
        return self._accepted_scores[candidate]


def simplest_of_ties(shortlist: Shortlist, best: Score) -> CandidateTerm:
    """The term with the fewest coefficients among those tied with the best."""
    coefficients = shortlist.context.validation.equations.coefficients
    tied = [
        score.candidate
        for score in shortlist.accepted(TIED_GAIN_RATIO * best.gain, coefficients(best.candidate))
        if log_ratio_t(best.squares, score.squares) < CLEARLY_BETTER_T
    ]
    return min([best.candidate, *tied], key=coefficients)
