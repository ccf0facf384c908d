"""How much a motion would tell between two hypotheses: the log likelihood ratio to be expected of it.

One hypothesis, with the coefficients that the recordings gave it, predicts what the recordings and the motion
would hold; of that the other one takes away what it can, with its own columns, with mass, friction, timing
and the other effects refitted, over recordings and motion together. What is left, r, would be evidence:

    E = (r_recordings+motion - r_recordings) / (2 sigma^2 tau)

sigma^2 is the variance that the diagnosis left, tau its correlation time in samples: n samples of coloured
noise tell as much as n / tau of white. Either may be true: the mean of both directions is what to expect, for
where one model holds the other within it, only the larger one can ever be told by what it leaves.
Sources: Box and Hill (1967), discrimination among models by expected evidence; Atkinson and Fedorov (1975),
T-optimal designs: the smallest distance from one model to all that the other can be.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from reconcile.catalogue.registry import hypotheses
from reconcile.ledger import Candidate, Ledger
from reconcile.scenes import FILTER_HZ, OVERSAMPLING, difference
from reconcile.smooth_terms import PREFIX

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Sense, Shape
    from reconcile.model_effects_known import Known
    from reconcile.rests import Rest

    Array = NDArray[np.float64]
    Term = tuple[str, Shape]
    """An effect in one of its shapes."""
    Option = tuple[Term, ...]
    """Terms that together are one model."""

LONGEST_TAU = 200
"""Samples after which correlation is not followed any further."""
FADED = 0.05


class Noise(NamedTuple):
    """Of what a diagnosis leaves, at the samples that it keeps."""

    variance: float
    """In N^2 or m^2."""
    tau: float
    """Correlation time in samples, 1 for white noise."""


class Sized(NamedTuple):
    """A term of a given size that nobody has seen."""

    term: Term
    coefficients: tuple[float, ...]


def noise_of(rests: Sequence[Rest]) -> Noise:
    """Of the rests of one sense, with all effects that were found."""
    products, pairs = np.zeros(LONGEST_TAU + 1), np.zeros(LONGEST_TAU + 1)
    for rest in rests:
        stride = max(int(1.0 / (rest.scene.period_s * OVERSAMPLING * FILTER_HZ)), 1)
        left, used = (rest.after * rest.used)[::stride], rest.used[::stride].astype(np.float64)
        for lag in range(min(LONGEST_TAU + 1, len(left))):
            products[lag] += left[lag:] @ left[: len(left) - lag]
            pairs[lag] += used[lag:] @ used[: len(used) - lag]
    covariance = products / np.maximum(pairs, 1.0)
    if covariance[0] <= 0.0:
        return Noise(1e-300, 1.0)
    correlation = covariance[1:] / covariance[0]
    faded = int(np.argmax(correlation < FADED)) if (correlation < FADED).any() else LONGEST_TAU
    return Noise(float(covariance[0]), 1.0 + 2.0 * float(correlation[:faded].sum()))


class Weighing:
    """One sense of one axis: the recordings that are there, and what may be asked of them and of motions."""

    def __init__(
        self,
        rests: Sequence[Rest],
        sense: Sense,
        known: Sequence[Known],
        terms: Sequence[Term],
    ) -> None:
        """`terms`: all that any option has."""
        self.sense = sense
        self._terms = list(dict.fromkeys(terms))
        noise = noise_of(rests)
        self._nats = 0.5 / (noise.variance * noise.tau)
        scenes = [rest.scene for rest in rests]
        found = difference(scenes, sense, self._terms, only=True, known=known)
        names = found.base_names
        self._columns: dict[Term, tuple[int, ...]] = {}
        place = len(names)
        for one in found.plan:
            self._columns[one.effect, one.shape] = tuple(range(place, place + one.width))
            place += one.width
        self._own_base = list(found.ledger.base)
        self._many = len(scenes) > 1
        self._recorded = _products(found.ledger)
        self._samples = _samples(found.ledger)
        self._held: dict[tuple[tuple[Option, ...], tuple[Option, ...]], float] = {}
        self._fitted: dict[tuple[Option, ...], tuple[list[tuple[int, int]], Array]] = {}

    def columns(self, term: Term) -> int:
        """So many coefficients a term has; 0 where it cannot be told here."""
        return len(self._columns.get(term, ()))

    def products(self, scene: Scene) -> tuple[Array, float]:
        """All products of columns of a motion that was not made, (1, c + 1, c + 1), and its samples."""
        found = difference([scene], self.sense, self._terms, only=True)
        return _products(found.ledger), float(_samples(found.ledger)[0])

    def recorded(self, truths: Sequence[Option], rivals: Sequence[Option]) -> float:
        """Evidence (nats) that the recordings hold already, if the first is true, against the other."""
        key = tuple(truths), tuple(rivals)
        if key not in self._held:
            self._held[key] = self._left(truths, rivals, None) * self._nats
        return self._held[key]

    def gained(
        self, truths: Sequence[Option], rivals: Sequence[Option], motion: tuple[Array, float]
    ) -> float:
        """Evidence (nats) that a motion is expected to add."""
        both = self._left(truths, rivals, motion) * self._nats
        return max(both - self.recorded(truths, rivals), 0.0)

    def hidden(self, sized: Sized, beside: Option, motion: tuple[Array, float] | None) -> float:
        """Evidence (nats) of something of this size against the model, in the recordings and a motion."""
        ledger = self._ledger([sized.term, *beside], motion)
        weights = np.zeros(ledger.gram.shape[1])
        for column, value in zip(ledger.candidates[0].columns, sized.coefficients, strict=True):
            weights[column + 1] = value
        predicted = np.stack([weights] * ledger.recordings)
        return self._rest(ledger, predicted, [beside]) * self._nats

    def _left(
        self, truths: Sequence[Option], rivals: Sequence[Option], motion: tuple[Array, float] | None
    ) -> float:
        """Sum of squares that the best rival leaves of what the best truth predicts."""
        ledger = self._ledger([term for option in (*truths, *rivals) for term in option], motion)
        slots, theta = self._fit(tuple(truths))
        weights = np.zeros((ledger.recordings, ledger.gram.shape[1]))
        for (column, own), value in zip(slots, theta, strict=True):
            weights[:, column + 1] += value if own < 0 else 0.0
            if own >= 0:
                weights[own, column + 1] += value
                if own == 0 and motion is not None:  # what a motion has for itself
                    weights[-1, column + 1] += value
        return self._rest(ledger, weights, rivals)

    def _fit(self, truths: tuple[Option, ...]) -> tuple[list[tuple[int, int]], Array]:
        """Slots and coefficients of the truth that fits the recordings best.

        Columns are those of a ledger whose terms begin with the truths'.
        """
        if truths not in self._fitted:
            ledger = self._ledger([term for option in truths for term in option], None)
            best = min(truths, key=lambda option: self._misfit(ledger, option))
            slots = ledger.slots(self._candidates(ledger, best))
            self._fitted[truths] = slots, ledger.real(slots, ledger.solve(slots, ledger.gram))
        return self._fitted[truths]

    def _ledger(self, terms: Sequence[Term], motion: tuple[Array, float] | None) -> Ledger:
        """Recordings, and the motion behind them, a block each; of the columns that these terms have."""
        place, candidates = len(self._own_base), []
        keep = list(range(place + 1))  # what is to be explained, and the base
        for term in dict.fromkeys(terms):
            columns = self._columns.get(term, ())
            candidates.append(self._candidate(term, tuple(range(place, place + len(columns)))))
            keep += [column + 1 for column in columns]
            place += len(columns)
        products = self._recorded if motion is None else np.concatenate((self._recorded, motion[0]))
        ledger = Ledger(self._own_base, candidates, np.arange(len(products)))
        ledger.gram = products[:, np.array(keep)[:, None], keep]
        ledger.samples[:] = np.append(self._samples, [] if motion is None else [motion[1]])
        ledger.normalise()
        return ledger

    def _candidate(self, term: Term, columns: tuple[int, ...]) -> Candidate:
        effect, shape = term
        own = not effect.startswith(PREFIX) and any(h.per_recording for h in hypotheses(effect, self.sense))
        return Candidate(effect, shape, own and self._many, columns)

    def _candidates(self, ledger: Ledger, option: Option) -> list[Candidate]:
        by_term = {(c.effect, c.shape): c for c in ledger.candidates}
        return [by_term[term] for term in dict.fromkeys(option)]

    def _misfit(self, ledger: Ledger, option: Option) -> float:
        slots = ledger.slots(self._candidates(ledger, option))
        theta = ledger.solve(slots, ledger.gram)
        return float(ledger.squares(slots, theta, np.arange(ledger.recordings)).sum())

    def _rest(self, ledger: Ledger, weights: Array, rivals: Sequence[Option]) -> float:
        """What the best rival leaves of a prediction, weights (recordings, c + 1) of columns as given."""
        given, unit = ledger.gram, ledger.unit[0]
        scaled = weights * ledger.unit  # of normalised columns
        row = np.einsum("rc,rcd->rd", scaled, given)
        corner = np.einsum("rd,rd->r", row, scaled)
        count = max(int(ledger.samples.sum()), 1)
        own_unit = float(np.sqrt(max(float(corner.sum()), 0.0) / count))  # normalised as all columns are
        if own_unit == 0.0:
            return 0.0
        predicted = given.copy()
        predicted[:, 0, :] = predicted[:, :, 0] = row / own_unit
        predicted[:, 0, 0] = corner / own_unit**2
        ledger.gram, ledger.unit[0] = predicted, own_unit
        least = min(self._misfit(ledger, option) for option in rivals)
        ledger.gram, ledger.unit[0] = given, unit
        return least


def _products(ledger: Ledger) -> Array:
    """By recording, of columns as they were given."""
    own = [ledger.recording_of_block == recording for recording in range(ledger.recordings)]
    sums = np.stack([ledger.gram[blocks].sum(axis=0) for blocks in own])
    products: Array = sums * ledger.unit[:, None] * ledger.unit
    ledger.rows.clear()
    return products


def _samples(ledger: Ledger) -> Array:
    counts = np.zeros(ledger.recordings)
    np.add.at(counts, ledger.recording_of_block, ledger.samples)
    return counts
