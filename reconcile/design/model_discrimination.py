"""Expected evidence of a motion between two models: the log likelihood ratio that recording it would add.

One model, with the coefficients that fit the recordings, predicts what recordings and motion would hold. The
rival is fitted to that prediction with its own columns, with mass, friction, timing and all other effects
refitted, over recordings and motion together. The residual r of that fit is the evidence:

    E = (|r|^2 of recordings and motion - |r|^2 of recordings) / (2 sigma^2 tau)

sigma^2 is the variance of the diagnosis' residual and tau its correlation time in samples: n samples of
coloured noise are worth n / tau of white noise. The caller averages both directions, each model taken as true
once: of nested models only the larger one can show by its residual. Sources: Box and Hill (1967),
discrimination among models by expected evidence; Atkinson and Fedorov (1975), T-optimal designs: the smallest
distance from one model to all predictions of the other.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from reconcile.catalogue.conversion import ModelTerm
from reconcile.catalogue.kinds import RegressionData, ResidualChannel, ShapeParameters
from reconcile.catalogue.registry import family
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.regression.normal_equations import BlockNormalEquations
from reconcile.regression.regression_data import stride
from reconcile.regression.regression_problem import regression_problem
from reconcile.regression.residual import Residual
from reconcile.regression.whiteness import lagged_products

Term = tuple[str, ShapeParameters]
"""An effect, or smooth term, with its shape parameters."""
Model = tuple[Term, ...]
"""Terms beside the rigid base; together one model."""

MAX_LAG = 200
"""Largest lag of the summed autocorrelation, samples. Chosen to bound the work, not calibrated."""
NEGLIGIBLE_CORRELATION = 0.05
"""The sum of the autocorrelation ends where it falls below this; the rest is estimation error."""


class ColouredNoise(NamedTuple):
    """The residual of a diagnosis as noise, at the samples of its regression."""

    variance: float
    """In N^2 or m^2."""
    correlation_samples: float
    """Correlation time in samples, 1 for white noise."""


class AssumedTerm(NamedTuple):
    """A term with assumed coefficients."""

    term: Term
    coefficients: tuple[float, ...]


def residual_noise(residuals: Sequence[Residual]) -> ColouredNoise:
    """Estimate the noise from the residuals of one channel, with all identified effects."""
    steps = [stride(residual.data.period_s) for residual in residuals]
    values = [residual.after[::step] for residual, step in zip(residuals, steps, strict=True)]
    used = [residual.used[::step] for residual, step in zip(residuals, steps, strict=True)]
    products, pairs = lagged_products(values, used, MAX_LAG)
    covariance = products / np.maximum(pairs, 1.0)
    if covariance[0] <= 0.0:
        return ColouredNoise(1e-300, 1.0)
    correlation = covariance[1:] / covariance[0]
    negligible = correlation < NEGLIGIBLE_CORRELATION
    end = int(np.argmax(negligible)) if negligible.any() else MAX_LAG
    return ColouredNoise(float(covariance[0]), 1.0 + 2.0 * float(correlation[:end].sum()))


class ModelDiscrimination:
    """The recordings of one channel of one axis, ready to be combined with planned motions."""

    def __init__(
        self,
        residuals: Sequence[Residual],
        channel: ResidualChannel,
        model_terms: Sequence[ModelTerm],
        terms: Sequence[Term],
    ) -> None:
        """Build the normal equations of the recordings; `terms` are those of all models to be compared."""
        self.channel = channel
        self._terms = list(dict.fromkeys(terms))
        noise = residual_noise(residuals)
        self._nats_per_square = 0.5 / (noise.variance * noise.correlation_samples)
        datasets = [residual.data for residual in residuals]
        found = regression_problem(datasets, channel, self._terms, only=True, model_terms=model_terms)
        names = found.baseline_names
        self._columns: dict[Term, tuple[int, ...]] = {}
        column_count = len(names)
        for one in found.terms:
            self._columns[one.effect, one.shape_parameters] = tuple(
                range(column_count, column_count + one.width)
            )
            column_count += one.width
        self._own_base = list(found.equations.baseline_is_free)
        self._several_recordings = len(datasets) > 1
        self._recorded = _products(found.equations)
        self._samples = _samples(found.equations)
        self._recorded_evidence: dict[tuple[tuple[Model, ...], tuple[Model, ...]], float] = {}
        self._fitted: dict[tuple[Model, ...], tuple[list[tuple[int, int]], Array]] = {}

    def width(self, term: Term) -> int:
        """Return how many coefficients a term has; 0 if these recordings do not determine it."""
        return len(self._columns.get(term, ()))

    def motion_products(self, data: RegressionData) -> tuple[Array, float]:
        """Return the Gram matrix (1, c + 1, c + 1) and the sample count of a planned motion."""
        found = regression_problem([data], self.channel, self._terms, only=True)
        return _products(found.equations), float(_samples(found.equations)[0])

    def recorded_evidence(self, true_models: Sequence[Model], rival_models: Sequence[Model]) -> float:
        """Return the evidence in nats that the recordings hold against the rivals if a true model is true."""
        key = tuple(true_models), tuple(rival_models)
        if key not in self._recorded_evidence:
            self._recorded_evidence[key] = (
                self._best_rival_misfit(true_models, rival_models, None) * self._nats_per_square
            )
        return self._recorded_evidence[key]

    def expected_gain(
        self, true_models: Sequence[Model], rival_models: Sequence[Model], motion: tuple[Array, float]
    ) -> float:
        """Return the evidence in nats that a motion is expected to add."""
        both = self._best_rival_misfit(true_models, rival_models, motion) * self._nats_per_square
        return max(both - self.recorded_evidence(true_models, rival_models), 0.0)

    def evidence_of_term(
        self, assumed: AssumedTerm, base_model: Model, motion: tuple[Array, float] | None
    ) -> float:
        """Return the evidence in nats of an assumed term against the model, in recordings and motion."""
        equations = self._equations([assumed.term, *base_model], motion)
        weights = np.zeros(equations.gram.shape[1])
        for column, value in zip(equations.candidates[0].columns, assumed.coefficients, strict=True):
            weights[column + 1] = value
        predicted = np.stack([weights] * equations.recordings)
        return self._least_misfit(equations, predicted, [base_model]) * self._nats_per_square

    def _best_rival_misfit(
        self, true_models: Sequence[Model], rival_models: Sequence[Model], motion: tuple[Array, float] | None
    ) -> float:
        """Return the squares that the best rival leaves of the prediction of the best true model."""
        equations = self._equations(
            [term for model in (*true_models, *rival_models) for term in model], motion
        )
        slots, theta = self._best_fit(tuple(true_models))
        weights = np.zeros((equations.recordings, equations.gram.shape[1]))
        for (column, own), value in zip(slots, theta, strict=True):
            weights[:, column + 1] += value if own < 0 else 0.0
            if own >= 0:
                weights[own, column + 1] += value
                # a motion has the coefficients by recording of the first recording
                if own == 0 and motion is not None:
                    weights[-1, column + 1] += value
        return self._least_misfit(equations, weights, rival_models)

    def _best_fit(self, true_models: tuple[Model, ...]) -> tuple[list[tuple[int, int]], Array]:
        """Return slots and coefficients of the true model that fits the recordings best.

        The columns are those of equations whose terms begin with those of `true_models`.
        """
        if true_models not in self._fitted:
            equations = self._equations([term for model in true_models for term in model], None)
            best = min(true_models, key=lambda model: self._misfit(equations, model))
            slots = equations.slots(self._candidates(equations, best))
            self._fitted[true_models] = (
                slots,
                equations.denormalised(slots, equations.solve(slots, equations.gram)),
            )
        return self._fitted[true_models]

    def _equations(self, terms: Sequence[Term], motion: tuple[Array, float] | None) -> BlockNormalEquations:
        """Return the normal equations of `terms`: a block for each recording, then one for the motion."""
        column_count, candidates = len(self._own_base), []
        keep = list(range(column_count + 1))  # the target, then the base
        for term in dict.fromkeys(terms):
            columns = self._columns.get(term, ())
            candidates.append(self._candidate(term, tuple(range(column_count, column_count + len(columns)))))
            keep += [column + 1 for column in columns]
            column_count += len(columns)
        products = self._recorded if motion is None else np.concatenate((self._recorded, motion[0]))
        equations = BlockNormalEquations(self._own_base, candidates, np.arange(len(products)))
        equations.gram = products[:, np.array(keep)[:, None], keep]
        equations.samples[:] = np.append(self._samples, [] if motion is None else [motion[1]])
        equations.normalise()
        return equations

    def _candidate(self, term: Term, columns: tuple[int, ...]) -> CandidateTerm:
        effect, shape = term
        of = family(effect, self.channel)
        own = of is not None and any(of.per_recording) and self._several_recordings
        return CandidateTerm(effect, shape, own, columns)

    def _candidates(self, equations: BlockNormalEquations, model: Model) -> list[CandidateTerm]:
        by_term = {(c.effect, c.shape_parameters): c for c in equations.candidates}
        return [by_term[term] for term in dict.fromkeys(model)]

    def _misfit(self, equations: BlockNormalEquations, model: Model) -> float:
        slots = equations.slots(self._candidates(equations, model))
        theta = equations.solve(slots, equations.gram)
        return float(equations.squares(slots, theta, np.arange(equations.recordings)).sum())

    def _least_misfit(
        self, equations: BlockNormalEquations, weights: Array, rival_models: Sequence[Model]
    ) -> float:
        """Return the squares that the best rival leaves of a prediction.

        weights (recordings, c + 1) are the coefficients of the columns that make the prediction.
        """
        given, unit = equations.gram, equations.unit[0]
        scaled = weights * equations.unit  # coefficients of normalised columns
        row = np.einsum("rc,rcd->rd", scaled, given)
        corner = np.einsum("rd,rd->r", row, scaled)
        count = max(int(equations.samples.sum()), 1)
        own_unit = float(np.sqrt(max(float(corner.sum()), 0.0) / count))  # normalised like the columns
        if own_unit == 0.0:
            return 0.0
        predicted = given.copy()
        predicted[:, 0, :] = predicted[:, :, 0] = row / own_unit
        predicted[:, 0, 0] = corner / own_unit**2
        equations.gram, equations.unit[0] = predicted, own_unit
        least = min(self._misfit(equations, model) for model in rival_models)
        equations.gram, equations.unit[0] = given, unit
        return least


def _products(equations: BlockNormalEquations) -> Array:
    """Return the Gram matrices by recording, of columns that are not normalised; frees the rows."""
    own = [equations.recording_of_block == recording for recording in range(equations.recordings)]
    sums = np.stack([equations.gram[blocks].sum(axis=0) for blocks in own])
    products: Array = sums * equations.unit[:, None] * equations.unit
    equations.rows.clear()
    return products


def _samples(equations: BlockNormalEquations) -> Array:
    """Return the sample counts by recording."""
    counts = np.zeros(equations.recordings)
    np.add.at(counts, equations.recording_of_block, equations.samples)
    return counts
