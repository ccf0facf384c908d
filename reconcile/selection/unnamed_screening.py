"""Screening of unnamed terms: a fast fit of each to the residual of the named terms chooses the few to try.

A curve over a coordinate may need nine knots or thirty, and the columns of all of them would take more memory
than every other candidate together. So each is first fitted to the residual alone, and judged on folds that
it was not fitted on; the best few are then tried beside the named terms. The moments of a step event are
screened by sums of products before and after each moment, all of them at once.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array, Index
from reconcile.catalogue.kinds import RegressionData, ShapeParameters
from reconcile.catalogue.smooth_terms import AT_A_PLACE, COORDINATES, PREFIX, SMOOTH_TERMS, SplineCoordinate
from reconcile.catalogue.unnamed_terms import TERMS, term
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.regression.normal_equations import SMOOTH_RIDGE
from reconcile.regression.regression_data import low_pass_of, stride
from reconcile.regression.regression_problem import RegressionProblem
from reconcile.selection.cross_validation import folds_of

MOST_SMOOTH = 6
"""Smooth terms that are tried beside the named ones: bounds the memory of their columns."""
MOMENT_PREFIX = "moment_of_"
"""Beginning of the names of step events, the quantity follows."""
MOST_MOMENTS = 3
"""Moments of each step event that are tried beside the named terms."""
BEFORE_ALL_S = -1.0
"""A moment before the first sample: all of the recording is after it."""
BUMP_BINS = 64
"""Bins of a coordinate's range; a narrow bump is sought around the one that explains most."""
WINDOW_SHARE, WINDOW_KNOTS = 1.0 / 8.0, 17.0
"""Share of the range around that bin that has knots of its own, and their number: they resolve a bump as wide
as a hundredth of the range."""


class _Screened(NamedTuple):
    """A smooth term at one set of shape parameters, by its gain."""

    gain: float
    """Share of the squares of the residual that it predicts."""
    effect: str
    shape: ShapeParameters


def promising_curves(
    problem: RegressionProblem, chosen: Sequence[CandidateTerm], blocks: Index
) -> list[tuple[str, ShapeParameters]]:
    """The most promising smooth terms as (effect, shape), beside the `chosen` ones, from `blocks` alone."""
    residual, fold_of = _residual(problem, chosen, blocks)
    best: list[_Screened] = []
    for name, of in SMOOTH_TERMS.items():
        effect = PREFIX + name
        shapes, own = of.shapes(problem.datasets), True in of.per_recording
        if len(COORDINATES[name].knots) > 1 and shapes:
            shapes = [*shapes, _window(problem, COORDINATES[name], shapes[0], residual, own=own)]
        tried = [
            _Screened(_gain(_columns(problem, effect, shape), residual, fold_of, own=own), effect, shape)
            for shape in shapes
        ]
        best += sorted(tried, reverse=True)[:1]
    best.sort(reverse=True)
    return [(one.effect, one.shape) for one in best[:MOST_SMOOTH]]


def promising_moments(
    problem: RegressionProblem, chosen: Sequence[CandidateTerm], blocks: Index
) -> list[tuple[str, ShapeParameters]]:
    """The moments as (effect, shape) at which a step explains most of the residual of the `chosen` terms."""
    residual, fold_of = _residual(problem, chosen, blocks)
    found = []
    for name, of in TERMS[problem.channel].items():
        if not name.startswith(MOMENT_PREFIX):
            continue
        effect, shapes = PREFIX + name, of.shapes(problem.datasets)
        moments_s = np.array([moment_s for (moment_s,) in shapes])
        sums = []
        everywhere = _columns(problem, effect, (BEFORE_ALL_S,))
        for data, used, x, y, fold in zip(
            problem.datasets, problem.used, everywhere, residual, fold_of, strict=True
        ):
            time_s = data.time_s[_kept(data, used)]
            factor = np.where(fold >= 0, 2.0 * x[:, 0], 0.0)
            at = np.searchsorted(time_s, moments_s)
            sums.append([np.append(0.0, np.cumsum(v))[[*at, -1]] for v in (factor * y, factor * factor)])
        parts = np.array(sums) if True in of.per_recording else np.array(sums).sum(axis=0)[None]
        products, squares = parts[:, 0], parts[:, 1]
        before, squares_before = products[:, :-1], squares[:, :-1]
        after, squares_after = products[:, -1:] - before, squares[:, -1:] - squares_before
        explained = before**2 / np.maximum(squares_before, 1e-300)
        explained = explained + after**2 / np.maximum(squares_after, 1e-300)
        order = explained.max(axis=0).argsort()[::-1] if shapes else []
        found += [(effect, shapes[place]) for place in order[:MOST_MOMENTS]]
    return found


def _residual(
    problem: RegressionProblem, chosen: Sequence[CandidateTerm], blocks: Index
) -> tuple[list[Array], list[Index]]:
    """Residual (n,) of the chosen terms in each recording, and the fold of each sample, -1 in none."""
    equations = problem.equations
    slots = equations.slots(chosen)
    weights = np.append(1.0, -equations.solve(slots, equations.totals(blocks)))
    column, active = equations.places(slots)
    places = np.append(0, column)
    fold = np.full(len(equations.samples), -1)
    fold[blocks] = folds_of(blocks)
    residual = []
    for rows, here in zip(equations.rows, active, strict=True):
        has = np.append(True, here)
        residual.append(weights[has] @ rows[places[has]])
    return residual, [fold[block] for block in equations.block]


def _window(
    problem: RegressionProblem,
    over: SplineCoordinate,
    whole: ShapeParameters,
    residual: Sequence[Array],
    *,
    own: bool,
) -> ShapeParameters:
    """Shape parameters of a curve around the bin of the coordinate that explains most of the residual.

    `own`: each recording has a curve of its own, so the bin is that of the recording that stands out.
    """
    low, high = whole[:2]
    products, squares = np.zeros((len(residual), BUMP_BINS)), np.zeros((len(residual), BUMP_BINS))
    for number, (data, used, values) in enumerate(zip(problem.datasets, problem.used, residual, strict=True)):
        kept = _kept(data, used)
        factor = np.ones(len(kept)) if over.factor is None else over.factor(data)[kept]
        place = (
            np.clip((over.values(data)[kept] - low) / max(high - low, 1e-300), 0.0, 1.0 - 1e-9) * BUMP_BINS
        )
        products[number] = np.bincount(place.astype(int), factor * values, BUMP_BINS)
        squares[number] = np.bincount(place.astype(int), factor * factor, BUMP_BINS)
    if not own:
        products, squares = products.sum(axis=0)[None], squares.sum(axis=0)[None]
    explained = products**2 / np.maximum(squares, 1e-300)
    centre = low + (int(explained.max(axis=0).argmax()) + 0.5) / BUMP_BINS * (high - low)
    half = 0.5 * WINDOW_SHARE * (high - low)
    return (centre - half, centre + half, WINDOW_KNOTS, AT_A_PLACE)


def _columns(problem: RegressionProblem, effect: str, shape: ShapeParameters) -> list[Array]:
    """Columns (n, k) of each recording, filtered, at the samples that count."""
    found = []
    for data, used in zip(problem.datasets, problem.used, strict=True):
        kept, low_pass = _kept(data, used), low_pass_of(data)
        columns = term(effect).columns(data, shape)
        few = np.empty((len(kept), columns.shape[1]))
        for number, column in enumerate(columns.T):  # filtered as a whole they would take gigabytes
            few[:, number] = low_pass(column)[kept]
        found.append(few)
    return found


def _kept(data: RegressionData, used: NDArray[np.bool_]) -> Index:
    """The samples that the normal equations have."""
    kept: Index = np.flatnonzero(used)[:: stride(data.period_s)]
    return kept


def _gain(columns: Sequence[Array], residual: Sequence[Array], fold: Sequence[Index], *, own: bool) -> float:
    """Share of the squared residual that the columns predict in folds that they were not fitted on."""
    groups = [[place] for place in range(len(columns))] if own else [[*range(len(columns))]]
    before = after = 0.0
    for group in groups:
        x, y, k = (_joined([of[place] for place in group]) for of in (columns, residual, fold))
        folds = [one for one in np.unique(k) if one >= 0]
        if not folds:
            continue  # a recording that is left out
        grams = [_gram(x, y, k == one) for one in folds]
        whole_g, whole_b, _ = (sum(parts) for parts in zip(*grams, strict=True))
        ridge = SMOOTH_RIDGE * max(float(whole_g.diagonal().max()), 1e-300) * np.eye(x.shape[1])
        for g, b, square in grams:
            theta = np.linalg.solve(whole_g - g + ridge, whole_b - b)
            before += square
            after += square - 2.0 * float(theta @ b) + float(theta @ g @ theta)
    return 1.0 - after / max(before, 1e-300)


def _joined(parts: Sequence[Any]) -> Any:
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def _gram(x: Array, y: Array, among: NDArray[np.bool_]) -> tuple[Array, Array, float]:
    """Products x'x (k, k), x'y (k,) and y'y of the samples in `among`."""
    part, target = x[among], y[among]
    return part.T @ part, part.T @ target, float(target @ target)
