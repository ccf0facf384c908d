"""What a hypothesis is worth: how much better blocks are predicted that it was not fitted on.

One wild block cannot carry a hypothesis, by the logarithm of its sums of squares nor by their difference.
How sure one must be grows with how many hypotheses were looked at.
"""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.stats import norm
from scipy.stats import t as student

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.ledger import Candidate, Ledger

    Array = NDArray[np.float64]
    Index = NDArray[np.int64]

FOLDS = 8
FOLD_BLOCKS = 3
"""Of a stretch: slow noise cannot be guessed from the blocks next to it."""
SHORTLIST = 30
"""So many hypotheses, the best by their fit, are judged on unseen blocks."""


INFORMATIVE = 0.3
"""Of a hypothesis' mean contribution: where it says less, a block tells nothing about it."""
FEWEST_INFORMATIVE = 20
MOST, FEW = 0.5, 1.5
"""Rare events: what predicts most of the whole, unseen, in more than two of them, is no chance."""
NEIGHBOURS = 20
"""Short blocks that may have noise in common: half a second."""
SHORT = 6
"""Samples of a block that is judged: 25 ms, nine time constants of the filter."""


class Rules(NamedTuple):
    """When a hypothesis is believed."""

    least_gain: float = 0.01
    """Share of the variance not yet explained that it must explain on unseen blocks."""
    least_share: float = 0.002
    """Share of the variance that there was at the beginning: crumbs of a great effect are no effect."""
    false_alarm: float = 0.01
    """Probability that the best of all hypotheses passes by chance."""
    least_set_gain: float = 0.1
    """The same of each further term of a set that is judged as a whole."""
    least_parameters: float = 0.15
    """Share of the variance that values fitted anew must take away for the model's own to be called off."""
    most_effects: int = 12
    least_unknown: float = 0.1
    """Share of what is left that a term without a name must explain to be called unknown physics."""
    least_unknown_share: float = 0.02
    """The same of the variance that there was at the beginning."""
    most_unknown: int = 2


class Score(NamedTuple):
    """A hypothesis on unseen blocks, against the model without it."""

    candidate: Candidate
    gain: float
    """Share of the sum of squares that it takes away."""
    t: float
    """Mean log gain of informative blocks in its standard errors."""
    summed: float
    """Self-normalised sum of their gains."""
    blocks: int
    """So many are informative."""
    squares: Array
    """By short block."""

    def beyond_chance(self, hypotheses: int, false_alarm: float) -> bool:
        """Whether the best of so many hypotheses would not be as good by chance."""
        if self.gain >= MOST and self.summed >= FEW:
            return True
        by_ratio = self.t >= threshold(hypotheses, self.blocks, false_alarm)
        return by_ratio or self.summed >= float(norm.isf(false_alarm / max(hypotheses, 1)))


class _Stretch(NamedTuple):
    """Samples of one recording that one fold predicts."""

    fold: int
    recording: int
    rows: Array
    """(c + 1, n)"""
    starts: Index
    """Where its short blocks begin."""


class Trial:
    """The blocks that are fitted on, in folds; judged by shorter blocks."""

    def __init__(self, ledger: Ledger, blocks: Index) -> None:
        self.ledger, self.blocks = ledger, blocks
        self.whole = ledger.totals(blocks)
        folds = min(FOLDS, max(len(blocks) // FOLD_BLOCKS, 2))
        fold = np.full(len(ledger.samples), -1)
        fold[blocks] = np.arange(len(blocks)) // FOLD_BLOCKS % folds
        self._others = np.stack([self.whole - ledger.totals(blocks[fold[blocks] == k]) for k in range(folds)])
        self.size = float(self.whole[:, 0, 0].sum())
        """Sum of squares of what is to be explained, normalised."""
        self._stretches = []
        ways_m = []
        for recording, (rows, block) in enumerate(zip(ledger.rows, ledger.block, strict=True)):
            for k in range(folds):
                own = np.flatnonzero(fold[block] == k)
                if len(own):
                    breaks = np.flatnonzero((np.diff(own) > 1) | (np.diff(block[own]) != 0)) + 1
                    starts = _short(len(own), breaks)
                    self._stretches.append(_Stretch(k, recording, rows[:, own], starts))
                    ways_m.append(np.minimum.reduceat(ledger.way_m[recording][own], starts))
        self.way_m = np.concatenate(ways_m)
        """Of each short block: what lies between it and the last reversal or rest."""

    def unseen(self, chosen: Sequence[Candidate]) -> Array:
        """Sum of squares of each short block, predicted from the other folds."""
        slots = self.ledger.slots(chosen)
        theta = self.ledger.solve(slots, self._others)
        return self._squares(slots, np.concatenate((np.ones((len(theta), 1)), -theta), axis=1), first=0)

    def given(self, chosen: Sequence[Candidate], theta: Array) -> Array:
        """The same with coefficients that are given."""
        weights = np.broadcast_to(np.concatenate(([1.0], -theta)), (len(self._others), len(theta) + 1))
        return self._squares(self.ledger.slots(chosen), weights, first=0)

    def _squares(self, slots: list[tuple[int, int]], weights: Array, first: int) -> Array:
        """Of a weighted sum: weight 0 is that of what is to be explained; summed from weight `first` on."""
        column, active = self.ledger.places(slots)
        places = np.concatenate(([0], column))[first:]
        found = []
        for fold, recording, rows, starts in self._stretches:
            here = np.concatenate(([True], active[recording]))[first:]
            sums = weights[fold, first:][here] @ rows[places[here]]
            found.append(np.add.reduceat(sums**2, starts))
        squares: Array = np.concatenate(found) * self.ledger.unit[0] ** 2
        return squares

    def coefficients(self, chosen: Sequence[Candidate]) -> Array:
        """Of the columns as they were given, fitted on all the blocks."""
        slots = self.ledger.slots(chosen)
        return self.ledger.real(slots, self.ledger.solve(slots, self.whole))

    def explained(self, chosen: Sequence[Candidate]) -> float:
        """What a fit on all the blocks explains, in units of y squared."""
        slots = self.ledger.slots(chosen)
        theta = self.ledger.solve(slots, self.whole)
        places = np.array([slot[0] + 1 for slot in slots])
        recording = np.array([slot[1] for slot in slots])
        products = np.where(
            recording < 0, self.whole.sum(axis=0)[places, 0], self.whole[recording, places, 0]
        )
        return float(theta @ products)

    def score(self, chosen: Sequence[Candidate], before: Array, candidate: Candidate) -> Score:
        """One hypothesis on top of those chosen, whose unseen squares are `before`."""
        return self.compare([*chosen, candidate], before)

    def compare(
        self,
        chosen: Sequence[Candidate],
        before: Array,
        terms: int = 1,
        among: NDArray[np.bool_] | None = None,
    ) -> Score:
        """A model against the unseen squares of another, `among` blocks; scored are its last candidates."""
        after = self.unseen(chosen)
        where = self._informative(chosen, terms)
        if among is not None:
            after, before, where = np.where(among, after, 0.0), np.where(among, before, 0.0), where & among
        gain = 1.0 - float(after.sum()) / max(float(before.sum()), 1e-300)
        t, total = paired(after, before, where), summed(after, before, where)
        return Score(chosen[-1], gain, t, total, int(where.sum()), after)

    def _informative(self, chosen: Sequence[Candidate], terms: int) -> NDArray[np.bool_]:
        """Blocks in which the last candidates have something to say, whether that is right or wrong."""
        slots = self.ledger.slots(chosen)
        first = len(self.ledger.slots(chosen[:-terms]))
        theta = self.ledger.solve(slots, self.whole)
        weights = np.broadcast_to(np.concatenate(([1.0], theta)), (len(self._others), len(theta) + 1))
        said = self._squares(slots, weights, first + 1)
        fewest = min(FEWEST_INFORMATIVE, len(said))
        return said >= min(INFORMATIVE * float(said.mean()), float(np.sort(said)[-fewest]))


def _short(length: int, breaks: Index) -> Index:
    """Where short blocks begin: at the breaks, and every so many samples between them."""
    edges = [0, *breaks.tolist(), length]
    starts = [
        np.arange(low, max(high - SHORT // 2, low + 1), SHORT) for low, high in itertools.pairwise(edges)
    ]
    return np.concatenate(starts)


def paired(better: Array, worse: Array, where: NDArray[np.bool_] | None = None) -> float:
    """Mean log ratio of the blocks' squares, in units of its standard error; positive where `better` is.

    Blocks follow one another in time; only those of `where` count.
    """
    full = (better > 0.0) & (worse > 0.0) & (True if where is None else where)
    ratio = np.log(worse[full] / better[full])
    if len(ratio) < 2 or not ratio.any():
        return 0.0
    series = np.zeros(len(better))
    series[full] = ratio - ratio.mean()
    error = math.sqrt(_long_run(series)) / len(ratio) + 1e-12
    return float(ratio.mean() / error)


def summed(better: Array, worse: Array, where: NDArray[np.bool_] | None = None) -> float:
    """Sum of the blocks' differences over the root of the sum of their squares: one event alone gives 1.

    Where chance is symmetric its distribution is no wider than the normal one, however long its tails
    (Efron 1969). It sees effects that matter in few blocks, and much; the ratios see those that matter a
    little in all.
    """
    saved = worse - better if where is None else np.where(where, worse - better, 0.0)
    return float(saved.sum() / (math.sqrt(_long_run(saved)) + 1e-300))


def _long_run(series: Array) -> float:
    """Sum of squares of a series, with what neighbours have in common (Newey and West 1987, equation 5)."""
    total = float(series @ series)
    for lag in range(1, min(NEIGHBOURS, len(series) - 1) + 1):
        total += 2.0 * (1.0 - lag / (NEIGHBOURS + 1.0)) * float(series[lag:] @ series[:-lag])
    return max(total, 0.2 * float(series @ series))


def threshold(hypotheses: int, blocks: int, false_alarm: float) -> float:
    """The t that the best of so many hypotheses exceeds by chance with this probability."""
    return float(student.isf(false_alarm / max(hypotheses, 1), max(blocks - 1, 1)))
