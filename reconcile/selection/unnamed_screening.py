"""Screening of unnamed terms: a fast fit of each to the residual of the named terms chooses the few to try.

A curve over a coordinate may need nine knots or thirty, and the columns of all of them would take more memory
than every other candidate together. So each is first fitted to the residual alone, and scored on folds that
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

MOST_SMOOTH_TERMS = 6
"""Smooth terms that are tried beside the named ones: bounds the memory of their columns."""
STEP_EVENT_PREFIX = "moment_of_"
"""Beginning of the names of step events; the quantity that steps follows."""
MOST_MOMENTS = 3
"""Moments of each step event that are tried beside the named terms: bounds the time; chosen."""
BEFORE_START_S = -1.0
"""A moment before the first sample: all of the recording is after it."""
BUMP_BINS = 64
"""Bins of a coordinate's range; knots are concentrated around the bin that explains most."""
WINDOW_SHARE, WINDOW_KNOTS = 1.0 / 8.0, 17.0
"""Share of the range around that bin that has knots of its own, and their number: they resolve a bump as wide
as a hundredth of the range."""

TermShape = tuple[str, ShapeParameters]
"""An effect and its shape parameters."""


class _ScreenedTerm(NamedTuple):
    """A smooth term at one set of shape parameters; sorts by its gain."""

    gain: float
    """Share of the squared residual that it predicts."""
    effect: str
    shape: ShapeParameters


class _FoldResidual(NamedTuple):
    """The residual of the named terms in the samples of the normal equations; by recording, (n,) each."""

    values: list[Array]
    folds: list[Index]
    """-1 in a block that is not used."""


def promising_curves(
    problem: RegressionProblem, chosen: Sequence[CandidateTerm], blocks: Index
) -> list[TermShape]:
    """The most promising smooth terms beside the `chosen` ones, from `blocks` alone."""
    residual = _residual(problem, chosen, blocks)
    best: list[_ScreenedTerm] = []
    for name, smooth_term in SMOOTH_TERMS.items():
        effect, per_recording = PREFIX + name, True in smooth_term.per_recording
        shapes = smooth_term.shapes(problem.datasets)
        if len(COORDINATES[name].knots) > 1 and shapes:
            window = _best_window(
                problem, COORDINATES[name], shapes[0], residual.values, per_recording=per_recording
            )
            shapes = [*shapes, window]
        screened = [
            _ScreenedTerm(
                _predicted_share(_columns(problem, effect, shape), residual, per_recording=per_recording),
                effect,
                shape,
            )
            for shape in shapes
        ]
        best += sorted(screened, reverse=True)[:1]
    best.sort(reverse=True)
    return [(screened.effect, screened.shape) for screened in best[:MOST_SMOOTH_TERMS]]


def predicted_shares(
    problem: RegressionProblem,
    chosen: Sequence[CandidateTerm],
    blocks: Index,
    candidate: TermShape,
    scales: Sequence[Array],
) -> list[float]:
    """Share of the squares that the `chosen` terms leave, which an unnamed term predicts.

    One for each of `scales` (k,) of its columns: under one ridge they decide how much each may contribute.
    """
    residual = _residual(problem, chosen, blocks)
    columns = _columns(problem, *candidate)
    return [
        _predicted_share([one * scale for one in columns], residual, per_recording=False) for scale in scales
    ]


def promising_moments(
    problem: RegressionProblem, chosen: Sequence[CandidateTerm], blocks: Index
) -> list[TermShape]:
    """The moments at which a step explains most of the residual of the `chosen` terms, by step event."""
    residual = _residual(problem, chosen, blocks)
    promising = []
    for name, step_event in TERMS[problem.channel].items():
        if not name.startswith(STEP_EVENT_PREFIX):
            continue
        effect, shapes = PREFIX + name, step_event.shapes(problem.datasets)
        moments_s = np.array([moment_s for (moment_s,) in shapes])
        explained = _explained_by_steps(
            problem, effect, moments_s, residual, per_recording=True in step_event.per_recording
        )
        order = explained.max(axis=0).argsort()[::-1] if shapes else []
        promising += [(effect, shapes[place]) for place in order[:MOST_MOMENTS]]
    return promising


def _explained_by_steps(
    problem: RegressionProblem, effect: str, moments_s: Array, residual: _FoldResidual, *, per_recording: bool
) -> Array:
    """Squares that a level before and one after each moment explain, (recordings or 1, moments)."""
    sums = []
    whole_columns = _columns(problem, effect, (BEFORE_START_S,))
    for data, used, column, values, fold in zip(
        problem.datasets, problem.used, whole_columns, residual.values, residual.folds, strict=True
    ):
        time_s = data.time_s[_kept_samples(data, used)]
        # the columns of a step event have half its height on either side
        factor = np.where(fold >= 0, 2.0 * column[:, 0], 0.0)
        at = np.searchsorted(time_s, moments_s)
        sums.append([np.append(0.0, np.cumsum(v))[[*at, -1]] for v in (factor * values, factor * factor)])
    by_group = np.array(sums) if per_recording else np.array(sums).sum(axis=0)[None]
    products, squares = by_group[:, 0], by_group[:, 1]
    before, squares_before = products[:, :-1], squares[:, :-1]
    after, squares_after = products[:, -1:] - before, squares[:, -1:] - squares_before
    explained: Array = before**2 / np.maximum(squares_before, 1e-300)
    explained += after**2 / np.maximum(squares_after, 1e-300)
    return explained


def _residual(problem: RegressionProblem, chosen: Sequence[CandidateTerm], blocks: Index) -> _FoldResidual:
    """Residual of the chosen terms, fitted on `blocks`."""
    equations = problem.equations
    slots = equations.slots(chosen)
    weights = np.append(1.0, -equations.solve(slots, equations.totals(blocks)))
    column, active = equations.places(slots)
    places = np.append(0, column)
    fold = np.full(len(equations.samples), -1)
    fold[blocks] = folds_of(blocks)
    values = []
    for rows, active_here in zip(equations.rows, active, strict=True):
        is_active = np.append(True, active_here)
        values.append(weights[is_active] @ rows[places[is_active]])
    return _FoldResidual(values, [fold[block] for block in equations.block])


def _best_window(
    problem: RegressionProblem,
    coordinate: SplineCoordinate,
    whole_range: ShapeParameters,
    residual: Sequence[Array],
    *,
    per_recording: bool,
) -> ShapeParameters:
    """Shape parameters of a curve around the bin of the coordinate that explains most of the residual.

    `per_recording`: each recording has its own curve, so the bin is that of the recording that stands out.
    """
    low, high = whole_range[:2]
    products, squares = np.zeros((len(residual), BUMP_BINS)), np.zeros((len(residual), BUMP_BINS))
    for number, (data, used, values) in enumerate(zip(problem.datasets, problem.used, residual, strict=True)):
        kept = _kept_samples(data, used)
        factor = np.ones(len(kept)) if coordinate.factor is None else coordinate.factor(data)[kept]
        position = (coordinate.values(data)[kept] - low) / max(high - low, 1e-300)
        bins = (np.clip(position, 0.0, 1.0 - 1e-9) * BUMP_BINS).astype(int)
        products[number] = np.bincount(bins, factor * values, BUMP_BINS)
        squares[number] = np.bincount(bins, factor * factor, BUMP_BINS)
    if not per_recording:
        products, squares = products.sum(axis=0)[None], squares.sum(axis=0)[None]
    explained = products**2 / np.maximum(squares, 1e-300)
    centre = low + (int(explained.max(axis=0).argmax()) + 0.5) / BUMP_BINS * (high - low)
    half = 0.5 * WINDOW_SHARE * (high - low)
    return (centre - half, centre + half, WINDOW_KNOTS, AT_A_PLACE)


def _columns(problem: RegressionProblem, effect: str, shape: ShapeParameters) -> list[Array]:
    """Columns (n, k) of each recording, filtered, at the samples that count."""
    by_recording = []
    for data, used in zip(problem.datasets, problem.used, strict=True):
        kept, low_pass = _kept_samples(data, used), low_pass_of(data)
        columns = term(effect).columns(data, shape)
        filtered = np.empty((len(kept), columns.shape[1]))
        for number, column in enumerate(columns.T):  # filtered as a whole they would take gigabytes
            filtered[:, number] = low_pass(column)[kept]
        by_recording.append(filtered)
    return by_recording


def _kept_samples(data: RegressionData, used: NDArray[np.bool_]) -> Index:
    """The samples that the normal equations have."""
    kept: Index = np.flatnonzero(used)[:: stride(data.period_s)]
    return kept


class _NormalEquations(NamedTuple):
    """Products of columns x (n, k) and target y (n,)."""

    gram: Array
    """x'x (k, k)."""
    right_side: Array
    """x'y (k,)."""
    target_squares: float


def _predicted_share(columns: Sequence[Array], residual: _FoldResidual, *, per_recording: bool) -> float:
    """Share of the squared residual that the columns predict in folds that they were not fitted on."""
    groups = [[number] for number in range(len(columns))] if per_recording else [[*range(len(columns))]]
    total_squares = remaining_squares = 0.0
    for group in groups:
        x = _joined([columns[number] for number in group])
        y = _joined([residual.values[number] for number in group])
        fold_of_sample = _joined([residual.folds[number] for number in group])
        folds = [fold for fold in np.unique(fold_of_sample) if fold >= 0]
        if not folds:
            continue  # a recording that is left out
        by_fold = [_normal_equations(x, y, fold_of_sample == fold) for fold in folds]
        gram = sum((fold.gram for fold in by_fold), np.zeros(()))
        right_side = sum((fold.right_side for fold in by_fold), np.zeros(()))
        ridge = SMOOTH_RIDGE * max(float(gram.diagonal().max()), 1e-300) * np.eye(x.shape[1])
        for fold in by_fold:
            theta = np.linalg.solve(gram - fold.gram + ridge, right_side - fold.right_side)
            total_squares += fold.target_squares
            remaining_squares += (
                fold.target_squares - 2.0 * float(theta @ fold.right_side) + float(theta @ fold.gram @ theta)
            )
    return 1.0 - remaining_squares / max(total_squares, 1e-300)


def _joined(parts: Sequence[Any]) -> Any:
    """The parts one after the other; a single one is not copied."""
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def _normal_equations(x: Array, y: Array, used: NDArray[np.bool_]) -> _NormalEquations:
    columns, target = x[used], y[used]
    return _NormalEquations(columns.T @ columns, columns.T @ target, float(target @ target))
