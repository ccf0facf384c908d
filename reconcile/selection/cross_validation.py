"""Cross-validation by blocks: how much better a term predicts blocks that it was not fitted on."""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from kernels.arrays import Array, Index, true_runs
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.regression.normal_equations import BlockNormalEquations
from reconcile.selection.block_statistics import bonferroni_threshold, log_ratio_t, self_normalised_sum

FOLDS = 8
"""Folds; each is predicted from the seven others."""
BLOCKS_IN_A_ROW = 3
"""Consecutive blocks (0.5 s each) in one fold, so that slow noise is not predicted from a neighbour."""
SHORTLIST = 30
"""Candidates that are cross-validated: the best by their plain fit."""
INFORMATIVE_SHARE = 0.3
"""Least contribution of a term to an informative block, as a share of its mean contribution."""
FEWEST_INFORMATIVE = 20
"""Blocks that are informative in any case: those with the largest contributions."""
RARE_EVENT_GAIN, RARE_EVENT_SUM = 0.5, 1.5
"""Gain and self-normalised sum from which on a term of rare events is significant: one event has a sum of 1,
three equal ones 1.7."""
SHORT_BLOCK_SAMPLES = 6
"""Length of a short block in kept samples: 25 ms, nine time constants of the state filter."""


class Score(NamedTuple):
    """A term's cross-validated squares against those of the model without it."""

    candidate: CandidateTerm
    gain: float
    """Share of the sum of squares that the term removes."""
    log_ratio_t: float
    """Mean log ratio of informative blocks, over its standard error."""
    normalised_sum: float
    """Self-normalised sum of the differences."""
    informative_blocks: int
    squares: Array
    """Cross-validated squares with the term, by short block."""

    def is_significant(self, candidates: int, false_alarm: float) -> bool:
        """Whether the score is beyond chance for the best of this number of `candidates`."""
        if self.gain >= RARE_EVENT_GAIN and self.normalised_sum >= RARE_EVENT_SUM:
            return True
        by_ratio = self.log_ratio_t >= bonferroni_threshold(candidates, self.informative_blocks, false_alarm)
        return by_ratio or self.normalised_sum >= float(norm.isf(false_alarm / max(candidates, 1)))


class _FoldSegment(NamedTuple):
    """Consecutive samples of one recording in one fold."""

    fold: int
    recording: int
    rows: Array
    """(c + 1, n): target and columns, a view of the rows of the recording."""
    starts: Index
    """First sample of each short block."""


def folds_of(blocks: Index) -> Index:
    """The fold of each block: runs of neighbours, in turn."""
    folds: Index = (
        np.arange(len(blocks)) // BLOCKS_IN_A_ROW % min(FOLDS, max(len(blocks) // BLOCKS_IN_A_ROW, 2))
    )
    return folds


class CrossValidation:
    """The training blocks in folds, judged by short blocks; squares are in units of y squared."""

    def __init__(self, equations: BlockNormalEquations, blocks: Index) -> None:
        self.equations, self.blocks = equations, blocks
        self.totals = equations.totals(blocks)
        """Normal equations of all training blocks, by recording."""
        fold = np.full(len(equations.samples), -1)
        fold[blocks] = folds_of(blocks)
        folds = int(fold.max()) + 1
        self._totals_without_fold = np.stack(
            [self.totals - equations.totals(blocks[fold[blocks] == k]) for k in range(folds)]
        )
        self.target_squares = float(self.totals[:, 0, 0].sum())
        """Sum of squares of the target, normalised."""
        self._segments = []
        travels_m = []
        for recording, (rows, block) in enumerate(zip(equations.rows, equations.block, strict=True)):
            for k in range(folds):
                for first, end in true_runs(fold[block] == k):
                    samples = slice(first, end)
                    starts = _short_block_starts(end - first, np.flatnonzero(np.diff(block[samples])) + 1)
                    self._segments.append(_FoldSegment(k, recording, rows[:, samples], starts))
                    travels_m.append(
                        np.minimum.reduceat(equations.settled_travel_m[recording][samples], starts)
                    )
        self.settled_travel_m = np.concatenate(travels_m)
        """Least distance since the last reversal or standstill in each short block, m."""

    def cross_validated_squares(self, chosen: Sequence[CandidateTerm]) -> Array:
        """Sum of squared residuals of each short block, predicted from the other folds."""
        slots = self.equations.slots(chosen)
        theta = self.equations.solve(slots, self._totals_without_fold)
        return self._squares(slots, np.concatenate((np.ones((len(theta), 1)), -theta), axis=1), first=0)

    def total_squares(self, chosen: Sequence[CandidateTerm]) -> float:
        """Sum of `cross_validated_squares`, from the folds' own products instead of the samples."""
        slots = self.equations.slots(chosen)
        theta = self.equations.solve(slots, self._totals_without_fold)
        column, active = self.equations.places(slots)
        places, is_active = np.append(0, column), np.insert(active, 0, values=True, axis=1).astype(np.float64)
        weights: Array = np.concatenate((np.ones((len(theta), 1)), -theta), axis=1)[:, None] * is_active
        of_places = (..., places[:, None], places)
        products = self.totals[of_places] - self._totals_without_fold[of_places]
        squared = np.einsum("kri,krij,krj->", weights, products, weights)
        return max(float(squared), 0.0) * float(self.equations.unit[0]) ** 2

    def gain(self, chosen: Sequence[CandidateTerm], squares_without: Array) -> float:
        """The gain that `score_last` would find of the last terms."""
        return 1.0 - self.total_squares(chosen) / max(float(squares_without.sum()), 1e-300)

    def squares_at(self, chosen: Sequence[CandidateTerm], theta: Array) -> Array:
        """Sum of squared residuals of each short block at these normalised coefficients."""
        return self._squares(self.equations.slots(chosen), np.concatenate(([1.0], -theta)), first=0)

    def _squares(self, slots: list[tuple[int, int]], weights: Array, first: int) -> Array:
        """Squares of the weighted columns from `first` on, by short block; column 0 is the target.

        `weights` (c + 1,) or by fold (folds, c + 1).
        """
        weights = np.broadcast_to(weights, (len(self._totals_without_fold), weights.shape[-1]))
        column, active = self.equations.places(slots)
        places = np.concatenate(([0], column))[first:]
        by_segment = []
        for fold, recording, rows, starts in self._segments:
            is_active = np.concatenate(([True], active[recording]))[first:]
            sums = weights[fold, first:][is_active] @ rows[places[is_active]]
            by_segment.append(np.add.reduceat(sums**2, starts))
        squares: Array = np.concatenate(by_segment) * self.equations.unit[0] ** 2
        return squares

    def coefficients(self, chosen: Sequence[CandidateTerm]) -> Array:
        """Coefficients of the columns before normalisation, fitted on all training blocks."""
        slots = self.equations.slots(chosen)
        return self.equations.denormalised(slots, self.equations.solve(slots, self.totals))

    def explained_squares(self, chosen: Sequence[CandidateTerm]) -> float:
        """Normalised squares that a fit on all training blocks explains."""
        slots = self.equations.slots(chosen)
        theta = self.equations.solve(slots, self.totals)
        places, recording = np.array([(column + 1, of_recording) for column, of_recording in slots]).T
        shared, of_one_recording = self.totals.sum(axis=0)[places, 0], self.totals[recording, places, 0]
        products = np.where(recording < 0, shared, of_one_recording)
        return float(theta @ products)

    def score(
        self, chosen: Sequence[CandidateTerm], squares_without: Array, candidate: CandidateTerm
    ) -> Score:
        """Score a candidate beside the `chosen` terms, which alone leave the cross-validated squares."""
        return self.score_last([*chosen, candidate], squares_without)

    def score_last(
        self,
        chosen: Sequence[CandidateTerm],
        squares_without: Array,
        last: int = 1,
        counted: NDArray[np.bool_] | None = None,
    ) -> Score:
        """Score the `last` terms of `chosen` against the cross-validated squares of a model without them.

        `counted`: the short blocks that count; all by default.
        """
        squares = self.cross_validated_squares(chosen)
        informative = self._informative(chosen, last)
        if counted is not None:
            squares = np.where(counted, squares, 0.0)
            squares_without = np.where(counted, squares_without, 0.0)
            informative &= counted
        return Score(
            candidate=chosen[-1],
            gain=1.0 - float(squares.sum()) / max(float(squares_without.sum()), 1e-300),
            log_ratio_t=log_ratio_t(squares, squares_without, informative),
            normalised_sum=self_normalised_sum(squares, squares_without, informative),
            informative_blocks=int(informative.sum()),
            squares=squares,
        )

    def _informative(self, chosen: Sequence[CandidateTerm], last: int) -> NDArray[np.bool_]:
        """Short blocks to which the `last` terms contribute, rightly or wrongly."""
        slots = self.equations.slots(chosen)
        first = len(self.equations.slots(chosen[:-last]))
        theta = self.equations.solve(slots, self.totals)
        contribution = self._squares(slots, np.concatenate(([1.0], theta)), first + 1)
        fewest = min(FEWEST_INFORMATIVE, len(contribution))
        least = INFORMATIVE_SHARE * float(contribution.mean())
        return contribution >= min(least, float(np.sort(contribution)[-fewest]))


def _short_block_starts(length: int, breaks: Index) -> Index:
    """First samples of the short blocks: at the breaks and every SHORT_BLOCK_SAMPLES between them."""
    edges = [0, *breaks.tolist(), length]
    starts = [
        np.arange(low, max(high - SHORT_BLOCK_SAMPLES // 2, low + 1), SHORT_BLOCK_SAMPLES)
        for low, high in itertools.pairwise(edges)
    ]
    return np.concatenate(starts)
