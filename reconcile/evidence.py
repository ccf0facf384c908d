"""What a hypothesis is worth: how much better blocks are predicted that it was not fitted on.

The gain of a block is the logarithm of its two sums of squares: one wild block cannot carry a hypothesis.
How sure one must be grows with how many hypotheses were looked at.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.stats import t as student

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.ledger import Candidate, Ledger

    Array = NDArray[np.float64]
    Index = NDArray[np.int64]

FOLDS = 8
SHORTLIST = 30
"""So many hypotheses, the best by their fit, are judged on unseen blocks."""


class Rules(NamedTuple):
    """When a hypothesis is believed."""

    least_gain: float = 0.01
    """Share of the variance not yet explained that it must explain on unseen blocks."""
    least_share: float = 0.002
    """Share of the variance that there was at the beginning: crumbs of a great effect are no effect."""
    false_alarm: float = 0.01
    """Probability that the best of all hypotheses passes by chance."""
    most_effects: int = 8
    least_unknown: float = 0.1
    """Share of the variance, first and last, that a smooth term must explain to be called unknown physics."""
    most_unknown: int = 2


class Score(NamedTuple):
    """A hypothesis on unseen blocks, against the model without it."""

    candidate: Candidate
    gain: float
    """Share of the sum of squares that it takes away."""
    t: float
    """Mean of the blocks' log gains in units of its standard error."""
    squares: Array
    """By block."""


class Trial:
    """The blocks that are fitted and judged on, in folds."""

    def __init__(self, ledger: Ledger, blocks: Index) -> None:
        self.ledger, self.blocks = ledger, blocks
        self.whole = ledger.totals(blocks)
        folds = min(FOLDS, len(blocks))
        self._fold = np.arange(len(blocks)) % folds
        self._others = np.stack([self.whole - ledger.totals(blocks[self._fold == k]) for k in range(folds)])

    def unseen(self, chosen: Sequence[Candidate]) -> Array:
        """Sum of squares of each block, predicted from the other folds."""
        slots = self.ledger.slots(chosen)
        theta = self.ledger.solve(slots, self._others)
        return self.ledger.squares(slots, theta[self._fold], self.blocks)

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

    def compare(self, chosen: Sequence[Candidate], before: Array) -> Score:
        """A model against the unseen squares of another; the score is that of its last candidate."""
        after = self.unseen(chosen)
        gain = 1.0 - float(after.sum()) / max(float(before.sum()), 1e-300)
        return Score(chosen[-1], gain, paired(after, before), after)


def paired(better: Array, worse: Array) -> float:
    """Mean log ratio of the blocks' squares, in units of its standard error; positive where `better` is."""
    full = (better > 0.0) & (worse > 0.0)
    ratio = np.log(worse[full] / better[full])
    if len(ratio) < 2 or not ratio.any():
        return 0.0
    return float(ratio.mean() / (ratio.std(ddof=1) / math.sqrt(len(ratio)) + 1e-12))


def threshold(hypotheses: int, blocks: int, false_alarm: float) -> float:
    """The t that the best of so many hypotheses exceeds by chance with this probability."""
    return float(student.isf(false_alarm / max(hypotheses, 1), max(blocks - 1, 1)))
