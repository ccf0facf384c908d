"""A load on a spring, sought in what the selected terms leave: most motions excite one in short events only.

The scan of `spring_behind_motor` needs a motion with much of its acceleration near the antiresonance. A jump
of acceleration excites it for some periods only, in a few blocks of which presliding and other effects hold
most. Beside these its frequency and damping are found by least squares, and it is accepted if with
coefficients from all parts but one it explains that part: noise, friction and one event do not.
"""

import math
from collections.abc import Iterable, Sequence

import numpy as np
from scipy.optimize import minimize

from kernels.arrays import Array, Index
from reconcile.catalogue.conversion import ModelTerm
from reconcile.catalogue.drive_compliance import ENTRY as DRIVE_COMPLIANCE
from reconcile.catalogue.kinds import ShapeParameters
from reconcile.catalogue.spring_behind_motor import (
    DAMPING_RATIO_BOUNDS,
    FIRST_DAMPING_RATIO,
    LEAST_GAIN,
    LOW_PASS_HZ,
    LOWEST_HZ,
    column,
    highest_hz,
)
from reconcile.regression.candidate_term import CandidateTerm, TermKey
from reconcile.regression.regression_data import low_pass_of, stride
from reconcile.regression.regression_problem import RegressionProblem, regression_problem
from reconcile.selection.predictive_terms import held_out_parts, held_out_squares_by_block

RATIO_OF_SCAN = 1.08
"""Ratio of neighbouring frequencies of the scan; chosen."""
MOST_EVALUATIONS = 60
"""Bounds the work of the search for frequency and damping after it."""


def spring_beside(
    problem: RegressionProblem, chosen: Sequence[CandidateTerm], train: Index
) -> TermKey | None:
    """Return the term of a load on a spring behind the motor that predicts what `chosen` terms leave, if any.

    `problem` has the force and the chosen terms; each recording of the `train` blocks (thirds of a single
    one) is left out in turn. Together and in most of them the spring removes LEAST_GAIN of the squares, or
    more, with a load that is less than the whole mass.
    """
    shape = _BesideTerms(problem, chosen, train).best_shape()
    if shape is None:
        return None
    effects = [(c.effect, c.shape_parameters) for c in chosen]
    wide = regression_problem(
        problem.datasets,
        problem.channel,
        [*effects, (DRIVE_COMPLIANCE.name, shape)],
        only=True,
        model_terms=problem.model_terms,
    )
    equations, spring = wide.equations, (DRIVE_COMPLIANCE.name, shape, False)
    others = [equations.by_key[c.key] for c in chosen]
    terms = [*others, equations.by_key[spring]]
    slots = equations.slots(terms)
    weights = equations.denormalised(slots, equations.solve(slots, equations.totals(train)))
    if not 0.0 < weights[-1] < weights[0]:
        return None
    parts = held_out_parts(equations, train)
    ends = np.cumsum([len(part) for part in parts])[:-1]
    before, after = (
        np.array([of.sum() for of in np.split(held_out_squares_by_block(equations, model, parts), ends)])
        for model in (others, terms)
    )
    is_predicted = after <= (1.0 - LEAST_GAIN) * before
    all_predicted = after.sum() <= (1.0 - LEAST_GAIN) * before.sum()
    return spring if all_predicted and is_predicted.sum() > 0.5 * len(parts) else None


def with_spring_refitted(
    problem: RegressionProblem, chosen: Sequence[CandidateTerm], train: Index, found: TermKey | None
) -> tuple[RegressionProblem, list[CandidateTerm]]:
    """Fit frequency and damping of the spring that was `found` once more, beside all other chosen terms.

    In the problem that is returned a disturbance is a force on the load, which any spring passes on.
    """
    spring = next((c for c in chosen if c.key == found), None)
    if spring is None:
        return passed_on_by_spring(problem, chosen)
    others = [c for c in chosen if c != spring]
    shape = _BesideTerms(problem, others, train).best_shape(spring.shape_parameters)
    at_best = spring._replace(shape_parameters=shape or spring.shape_parameters)
    return passed_on_by_spring(problem, [at_best if c == spring else c for c in chosen])


def passed_on_by_spring(
    problem: RegressionProblem, chosen: Sequence[CandidateTerm]
) -> tuple[RegressionProblem, list[CandidateTerm]]:
    """Compute the columns of the `chosen` terms behind the spring among them or in the model, if any."""
    spring = spring_of(chosen) or spring_of(problem.model_terms)
    if spring == problem.datasets[0].spring:
        return problem, [*chosen]
    again = regression_problem(
        [data._replace(spring=spring) for data in problem.datasets],
        problem.channel,
        [(c.effect, c.shape_parameters) for c in chosen],
        only=True,
        model_terms=problem.model_terms,
    )
    return again, [again.equations.by_key[c.key] for c in chosen]


def spring_of(terms: Iterable[CandidateTerm | ModelTerm]) -> ShapeParameters:
    """Return antiresonance (Hz) and damping ratio of the spring among the terms of a force; empty if none."""
    return next((one.shape_parameters for one in terms if one.effect == DRIVE_COMPLIANCE.name), ())


class _BesideTerms:
    """The training samples of all recordings: the residual of the chosen terms, and their projection."""

    def __init__(self, problem: RegressionProblem, chosen: Sequence[CandidateTerm], train: Index) -> None:
        self._datasets, equations = problem.datasets, problem.equations
        slots = equations.slots(chosen)
        self._kept: list[Index] = []
        targets, columns = [], []
        for recording, data in enumerate(problem.datasets):
            is_train = np.isin(problem.block_of[recording], train)
            kept = np.flatnonzero(problem.used[recording])[:: stride(data.period_s)]
            kept = kept[is_train[kept]]
            target, of = problem.target_and_columns(recording)
            columns.append(
                np.stack(
                    [of[kept, k] if own in (-1, recording) else np.zeros(len(kept)) for k, own in slots], 1
                )
            )
            targets.append(target[kept])
            self._kept.append(kept)
        base = np.concatenate(columns)
        sizes = np.linalg.norm(base, axis=0)
        self._basis, _ = np.linalg.qr(base / np.where(sizes > 0.0, sizes, 1.0))
        self._residual_n = self._beside(np.concatenate(targets))

    def best_shape(self, start: ShapeParameters = ()) -> ShapeParameters | None:
        """Frequency in Hz and damping ratio that explain most, from a `start` or from a scan.

        None where they explain less than LEAST_GAIN, or most at a bound: gravity and friction, which resemble
        a soft spring, have no antiresonance within the range.
        """
        top_hz = highest_hz(self._datasets) if start else min(highest_hz(self._datasets), LOW_PASS_HZ)
        if top_hz <= LOWEST_HZ * RATIO_OF_SCAN or not len(self._residual_n):
            return None

        def unexplained_share(logarithms: Array) -> float:
            frequency_hz, ratio = (float(value) for value in np.exp(logarithms))
            lowest, highest = DAMPING_RATIO_BOUNDS
            if not LOWEST_HZ < frequency_hz < top_hz or not lowest < ratio < highest:
                return math.inf
            return 1.0 - self._explained(frequency_hz, ratio)

        count = math.ceil(math.log(top_hz / LOWEST_HZ) / math.log(RATIO_OF_SCAN))
        grid_hz = np.geomspace(LOWEST_HZ, top_hz, count + 1)[1:-1]
        starts = [start] if start else [(hz, FIRST_DAMPING_RATIO) for hz in grid_hz]
        first = min((np.log(one) for one in starts), key=unexplained_share)
        best = minimize(
            unexplained_share,
            first,
            method="Nelder-Mead",
            options={"maxfev": MOST_EVALUATIONS, "xatol": 1e-3, "fatol": 1e-5},
        )
        frequency_hz, ratio = (float(value) for value in np.exp(best.x))
        is_within = (
            LOWEST_HZ * RATIO_OF_SCAN < frequency_hz < top_hz / RATIO_OF_SCAN
            and ratio < DAMPING_RATIO_BOUNDS[1] / RATIO_OF_SCAN
        )
        return (frequency_hz, ratio) if is_within and best.fun <= 1.0 - LEAST_GAIN else None

    def _explained(self, frequency_hz: float, ratio: float) -> float:
        """Share of the residual's squares that a load of positive mass explains."""
        parts = []
        for data, kept in zip(self._datasets, self._kept, strict=True):
            unfiltered = column(data.motion.position_m, data.period_s, frequency_hz, ratio)
            parts.append(low_pass_of(data)(unfiltered)[kept])
        own = self._beside(np.concatenate(parts))
        product = float(own @ self._residual_n)
        squares = float(own @ own) * float(self._residual_n @ self._residual_n)
        return product**2 / squares if product > 0.0 and squares > 0.0 else 0.0

    def _beside(self, values: Array) -> Array:
        rest: Array = values - self._basis @ (self._basis.T @ values)
        return rest
