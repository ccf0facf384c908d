"""Which effects a difference asks for: forward selection by blocks that were not fitted on.

A hypothesis is taken when it predicts unseen blocks better, by a share that matters and in so many of them
that chance does not explain it. The gain of a block is the logarithm of its two sums of squares: one wild
block cannot carry a hypothesis. How sure one must be grows with how many hypotheses were looked at.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.stats import t as student

from reconcile.smooth_terms import PREFIX

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.ledger import Candidate, Ledger

    Array = NDArray[np.float64]
    Index = NDArray[np.int64]

FOLDS = 8
MULTIPLE = (
    "cogging",
    "torque_ripple",
    "lead_error_periodic",
    "periodic_disturbance",
    "presliding_hysteresis",
    "scale_cyclic_error",
)
"""Effects that are sums of several shapes; of the others one shape is the best."""
SHORTLIST = 30
"""So many hypotheses, the best by their fit, are judged on unseen blocks."""


class Rules(NamedTuple):
    """When a hypothesis is believed."""

    least_gain: float = 0.01
    """Share of the unexplained variance that it must explain on unseen blocks."""
    false_alarm: float = 0.01
    """Probability that the best of all hypotheses passes by chance."""
    most_effects: int = 8


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
        fold = np.arange(len(blocks)) % FOLDS
        self._folds = [
            (np.flatnonzero(fold == k), self.whole - ledger.totals(blocks[fold == k]))
            for k in range(min(FOLDS, len(blocks)))
        ]

    def unseen(self, chosen: Sequence[Candidate]) -> Array:
        """Sum of squares of each block, predicted from the other folds."""
        slots = self.ledger.slots(chosen)
        found = np.zeros(len(self.blocks))
        for held, others in self._folds:
            theta = self.ledger.solve(slots, others)
            found[held] = self.ledger.squares(slots, theta, self.blocks[held])
        return found

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
        full = self.ledger.samples[self.blocks] > 0
        log_gain = np.log(np.maximum(before[full], 1e-300) / np.maximum(after[full], 1e-300))
        spread = float(log_gain.std(ddof=1)) / math.sqrt(len(log_gain)) + 1e-12
        gain = 1.0 - float(after.sum()) / max(float(before.sum()), 1e-300)
        return Score(chosen[-1], gain, float(log_gain.mean()) / spread, after)


def threshold(hypotheses: int, blocks: int, false_alarm: float) -> float:
    """The t that the best of so many hypotheses exceeds by chance with this probability."""
    return float(student.isf(false_alarm / max(hypotheses, 1), max(blocks - 1, 1)))


def forward(trial: Trial, rules: Rules) -> list[Candidate]:
    """The hypotheses that are believed, each on top of those before it."""
    candidates = trial.ledger.candidates
    chosen: list[Candidate] = []
    before = trial.unseen(chosen)
    needed = threshold(len(candidates), len(trial.blocks), rules.false_alarm)
    while len(chosen) < rules.most_effects:
        single = {c.effect for c in chosen} - set(MULTIPLE)
        rest = [
            c
            for c in candidates
            if c not in chosen and c.effect not in single and not c.effect.startswith(PREFIX)
        ]
        explained = {candidate: trial.explained([*chosen, candidate]) for candidate in rest}
        short = sorted(rest, key=lambda candidate: explained[candidate], reverse=True)[:SHORTLIST]
        scores = [trial.score(chosen, before, candidate) for candidate in short]
        believed = [score for score in scores if score.t >= needed and score.gain >= rules.least_gain]
        if not believed:
            break
        best = max(believed, key=lambda score: score.gain)
        chosen.append(best.candidate)
        before = best.squares
    return chosen
