"""Cross-validation by blocks: how much better a term predicts blocks that it was not fitted on."""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from kernels.arrays import Array, Index
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.regression.normal_equations import BlockNormalEquations
from reconcile.selection.block_statistics import paired, summed, threshold

FOLDS = 8
"""Folds; each is predicted from the seven others."""
FOLD_RUN = 3
"""Consecutive blocks (0.5 s each) in one fold, so that slow noise is not predicted from a neighbour."""
SHORTLIST = 30
"""Candidates that are cross-validated: the best by their plain fit."""
INFORMATIVE_SHARE = 0.3
"""Least contribution of a term to an informative block, as a share of its mean contribution."""
FEWEST_INFORMATIVE = 20
"""Blocks that are informative in any case: those with the largest contributions."""
RARE_EVENT_GAIN, RARE_EVENT_SUM = 0.5, 1.5
"""Gain and self-normalised sum from which on a term of rare events is accepted: one event has a sum of 1,
three equal ones 1.7."""
BLOCK_SAMPLES = 6
"""Length of a short block in kept samples: 25 ms, nine time constants of the state filter."""


class SelectionRules(NamedTuple):
    """When a term is accepted; calibrated on training seeds of the blind trials (docs/blind-trials.md)."""

    least_gain: float = 0.01
    """Least share of the unexplained variance that a term explains, cross-validated."""
    least_share: float = 0.002
    """Least share of the initial variance: less is the misfit of a larger effect."""
    false_alarm: float = 0.01
    """Probability that the best of all candidates passes by chance."""
    least_set_gain: float = 0.1
    """Least share of the unexplained variance of each further term in a set that is judged as a whole."""
    least_parameters: float = 0.15
    """Least share of the variance that refitting removes where the nominal values are reported as wrong."""
    most_effects: int = 12
    """Terms in one channel."""
    least_unknown: float = 0.1
    """Least share of the unexplained variance of an unnamed term."""
    least_unknown_share: float = 0.02
    """Least share of the initial variance of an unnamed term."""
    most_unknown: int = 2
    """Unnamed terms in one channel."""
    matters: float = 0.01
    """Share of the force that the motion needs below which an effect is negligible."""


class Score(NamedTuple):
    """A term's cross-validated squares against those of the model without it."""

    candidate: CandidateTerm
    gain: float
    """Share of the sum of squares that the term removes."""
    t: float
    """Mean log ratio of informative blocks, over its standard error."""
    summed: float
    """Self-normalised sum of the differences."""
    blocks: int
    """Number of informative blocks."""
    squares: Array
    """Cross-validated squares with the term, by short block."""

    def beyond_chance(self, candidates: int, false_alarm: float) -> bool:
        """Whether the score is significant as the best one of this number of `candidates`."""
        if self.gain >= RARE_EVENT_GAIN and self.summed >= RARE_EVENT_SUM:
            return True
        by_ratio = self.t >= threshold(candidates, self.blocks, false_alarm)
        return by_ratio or self.summed >= float(norm.isf(false_alarm / max(candidates, 1)))


class _Stretch(NamedTuple):
    """Consecutive samples of one recording in one fold."""

    fold: int
    recording: int
    rows: Array
    """(c + 1, n), a view of the rows of the recording."""
    starts: Index
    """First sample of each short block."""


def folds_of(blocks: Index) -> Index:
    """The fold of each block: runs of neighbours, in turn."""
    folds: Index = np.arange(len(blocks)) // FOLD_RUN % min(FOLDS, max(len(blocks) // FOLD_RUN, 2))
    return folds


class CrossValidation:
    """The training blocks in folds, judged by short blocks; squares are in units of y squared."""

    def __init__(self, equations: BlockNormalEquations, blocks: Index) -> None:
        self.equations, self.blocks = equations, blocks
        self.whole = equations.totals(blocks)
        fold = np.full(len(equations.samples), -1)
        fold[blocks] = folds_of(blocks)
        folds = int(fold.max()) + 1
        self._training_totals = np.stack(
            [self.whole - equations.totals(blocks[fold[blocks] == k]) for k in range(folds)]
        )
        self.size = float(self.whole[:, 0, 0].sum())
        """Sum of squares of the target, normalised."""
        self._stretches = []
        travels_m = []
        for recording, (rows, block) in enumerate(zip(equations.rows, equations.block, strict=True)):
            for k in range(folds):
                for first, last in _runs(fold[block] == k):
                    own = slice(first, last)
                    starts = _block_starts(last - first, np.flatnonzero(np.diff(block[own])) + 1)
                    self._stretches.append(_Stretch(k, recording, rows[:, own], starts))
                    travels_m.append(np.minimum.reduceat(equations.settled_travel_m[recording][own], starts))
        self.settled_travel_m = np.concatenate(travels_m)
        """Least distance since the last reversal or standstill in each short block, m."""

    def cross_validated_squares(self, chosen: Sequence[CandidateTerm]) -> Array:
        """Sum of squared residuals of each short block, predicted from the other folds."""
        slots = self.equations.slots(chosen)
        theta = self.equations.solve(slots, self._training_totals)
        return self._squares(slots, np.concatenate((np.ones((len(theta), 1)), -theta), axis=1), first=0)

    def total_squares(self, chosen: Sequence[CandidateTerm]) -> float:
        """Sum of `cross_validated_squares`, from the folds' own products instead of the samples."""
        slots = self.equations.slots(chosen)
        theta = self.equations.solve(slots, self._training_totals)
        column, active = self.equations.places(slots)
        places, has = np.append(0, column), np.insert(active, 0, values=True, axis=1).astype(np.float64)
        weights: Array = np.concatenate((np.ones((len(theta), 1)), -theta), axis=1)[:, None] * has
        sub = (..., places[:, None], places)
        products = self.whole[sub] - self._training_totals[sub]
        squared = np.einsum("kri,krij,krj->", weights, products, weights)
        return max(float(squared), 0.0) * float(self.equations.unit[0]) ** 2

    def gain(self, chosen: Sequence[CandidateTerm], before: Array) -> float:
        """The gain that `compare` would find of the last terms."""
        return 1.0 - self.total_squares(chosen) / max(float(before.sum()), 1e-300)

    def squares_with(self, chosen: Sequence[CandidateTerm], theta: Array) -> Array:
        """Sum of squared residuals of each short block with these normalised coefficients."""
        return self._squares(self.equations.slots(chosen), np.concatenate(([1.0], -theta)), first=0)

    def _squares(self, slots: list[tuple[int, int]], weights: Array, first: int) -> Array:
        """Squares of the weighted columns from `first` on, by short block; column 0 is the target.

        `weights` (c + 1,) or by fold (folds, c + 1).
        """
        weights = np.broadcast_to(weights, (len(self._training_totals), weights.shape[-1]))
        column, active = self.equations.places(slots)
        places = np.concatenate(([0], column))[first:]
        found = []
        for fold, recording, rows, starts in self._stretches:
            here = np.concatenate(([True], active[recording]))[first:]
            sums = weights[fold, first:][here] @ rows[places[here]]
            found.append(np.add.reduceat(sums**2, starts))
        squares: Array = np.concatenate(found) * self.equations.unit[0] ** 2
        return squares

    def coefficients(self, chosen: Sequence[CandidateTerm]) -> Array:
        """Coefficients of the columns before normalisation, fitted on all training blocks."""
        slots = self.equations.slots(chosen)
        return self.equations.denormalised(slots, self.equations.solve(slots, self.whole))

    def explained(self, chosen: Sequence[CandidateTerm]) -> float:
        """Normalised squares that a fit on all training blocks explains."""
        slots = self.equations.slots(chosen)
        theta = self.equations.solve(slots, self.whole)
        places, recording = np.array([(column + 1, own) for column, own in slots]).T
        shared, own = self.whole.sum(axis=0)[places, 0], self.whole[recording, places, 0]
        products = np.where(recording < 0, shared, own)
        return float(theta @ products)

    def score(self, chosen: Sequence[CandidateTerm], before: Array, candidate: CandidateTerm) -> Score:
        """Score a candidate beside the `chosen` terms, whose cross-validated squares are `before`."""
        return self.compare([*chosen, candidate], before)

    def compare(
        self,
        chosen: Sequence[CandidateTerm],
        before: Array,
        terms: int = 1,
        among: NDArray[np.bool_] | None = None,
    ) -> Score:
        """Score the last `terms` of `chosen` against the squares `before` of a model without them.

        `among`: the short blocks that count; all by default.
        """
        after = self.cross_validated_squares(chosen)
        where = self._informative(chosen, terms)
        if among is not None:
            after, before, where = np.where(among, after, 0.0), np.where(among, before, 0.0), where & among
        gain = 1.0 - float(after.sum()) / max(float(before.sum()), 1e-300)
        t, total = paired(after, before, where), summed(after, before, where)
        return Score(
            candidate=chosen[-1], gain=gain, t=t, summed=total, blocks=int(where.sum()), squares=after
        )

    def _informative(self, chosen: Sequence[CandidateTerm], terms: int) -> NDArray[np.bool_]:
        """Short blocks to which the last `terms` contribute, rightly or wrongly."""
        slots = self.equations.slots(chosen)
        first = len(self.equations.slots(chosen[:-terms]))
        theta = self.equations.solve(slots, self.whole)
        contribution = self._squares(slots, np.concatenate(([1.0], theta)), first + 1)
        fewest = min(FEWEST_INFORMATIVE, len(contribution))
        least = INFORMATIVE_SHARE * float(contribution.mean())
        return contribution >= min(least, float(np.sort(contribution)[-fewest]))


def _runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and one past last index of each run of true values."""
    edges = np.flatnonzero(np.diff(flags.astype(np.int8), prepend=0, append=0))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _block_starts(length: int, breaks: Index) -> Index:
    """First samples of the short blocks: at the breaks and every BLOCK_SAMPLES between them."""
    edges = [0, *breaks.tolist(), length]
    starts = [
        np.arange(low, max(high - BLOCK_SAMPLES // 2, low + 1), BLOCK_SAMPLES)
        for low, high in itertools.pairwise(edges)
    ]
    return np.concatenate(starts)
