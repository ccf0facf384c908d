"""The regression problem of a residual channel: filtered columns of all terms, blocks, normal equations."""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array, Index
from reconcile.catalogue.conversion import ModelTerm
from reconcile.catalogue.kinds import OWN, SHARED, RegressionData, ResidualChannel, ShapeParameters
from reconcile.catalogue.registry import ENTRIES, family, has_levels
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.catalogue.unnamed_terms import columns_of, term
from reconcile.regression.blocks import blocks_of
from reconcile.regression.candidate_term import CandidateTerm, TermKey
from reconcile.regression.normal_equations import BlockNormalEquations
from reconcile.regression.regression_data import low_pass_of, samples_in_use, stride, target_and_baseline
from reconcile.regression.resolution import settled_travel_m

BASELINE_PARAMETERS = {
    ResidualChannel.FORCE: ["mass_kg", "viscous_n_s_m", "coulomb_n"],
    ResidualChannel.POSITION_DEVIATION: ["origin_m", "delay_s"],
}
"""Parameters of every model, by channel."""
FREE_IN_EACH_RECORDING = ("origin_m",)
"""Those with a value for each recording, because sensors are re-zeroed."""
SINCE_REVERSAL = PREFIX + "distance_since_reversal"
"""Unnamed term over the distance since the reversal; always a candidate, because presliding shows there."""


class TermColumns(NamedTuple):
    """A term and the columns that it adds."""

    effect: str
    shape_parameters: ShapeParameters
    columns: Callable[[RegressionData, ShapeParameters], Array]
    width: int


class RegressionProblem(NamedTuple):
    """The regression of one residual channel of one axis; arrays by recording."""

    channel: ResidualChannel
    datasets: Sequence[RegressionData]
    equations: BlockNormalEquations
    terms: list[TermColumns]
    used: list[NDArray[np.bool_]]
    """(n,) for each recording: the samples that are fitted and judged."""
    block_of: list[Index]
    """(n,) for each recording: the block that a sample is in."""
    model_terms: Sequence[ModelTerm]
    """Terms of the nominal model; their prediction is subtracted from the target."""

    @property
    def baseline_names(self) -> list[str]:
        """Parameters of every model of the channel, which have the first columns."""
        return BASELINE_PARAMETERS[self.channel]

    def target(self, recording: int) -> Array:
        """Target (n,) of a recording, filtered, less what the model predicts already."""
        return _target_and_baseline(self.datasets[recording], self.channel, self.model_terms)[0]

    def target_and_columns(self, recording: int) -> tuple[Array, Array]:
        """Target (n,) and all columns (n, c) of a recording, filtered, not normalised; for few terms."""
        data = self.datasets[recording]
        target, base = _target_and_baseline(data, self.channel, self.model_terms)
        columns = [column for _, column in _filtered_columns(data, base, self.terms)]
        return target, np.stack(columns, axis=1)

    def prediction(self, recording: int, coefficients: Sequence[tuple[int, float]]) -> Array:
        """Sum (n,) of filtered columns, each (column, weight) before normalisation, in a recording.

        One term's columns are in memory at a time: those of a long recording would take gigabytes.
        """
        data, total = self.datasets[recording], np.zeros(len(self.used[recording]))
        unfiltered = np.zeros(len(total))
        _, base = target_and_baseline(data, self.channel)
        low_pass = low_pass_of(data)
        firsts = np.cumsum([base.shape[1], *(one.width for one in self.terms)])
        computed, columns = -1, base
        for column, weight in coefficients:
            number = int(np.searchsorted(firsts, column, side="right")) - 1
            if number < 0:
                total += weight * base[:, column]
                continue
            if number != computed:
                one = self.terms[number]
                computed, columns = number, one.columns(data, one.shape_parameters)
            unfiltered += weight * columns[:, column - firsts[number]]
        return total + low_pass(unfiltered) if computed >= 0 else total


def predicted_by_model(
    data: RegressionData, channel: ResidualChannel, model_terms: Sequence[ModelTerm]
) -> Array:
    """Prediction of the terms that the model has already (n,), unfiltered."""
    total = np.zeros(len(data.time_s))
    for one in model_terms:
        if columns := columns_of(one.effect, channel):
            total += columns(data, one.shape_parameters) @ np.array(one.coefficients)
    return total


def regression_problem(
    datasets: Sequence[RegressionData],
    channel: ResidualChannel,
    extra: Sequence[tuple[str, ShapeParameters]] = (),
    *,
    only: bool = False,
    model_terms: Sequence[ModelTerm] = (),
    spare: int = 0,
) -> RegressionProblem:
    """Set up the regression of a channel, less what the model predicts already.

    `extra`: further terms (effect, shape parameters); `only`: no terms but these; `spare`: columns that
    `extended` may add.
    """
    terms = _terms(datasets, channel, extra, only=only)
    used = [samples_in_use(data, channel) for data in datasets]
    block_of, recording_of_block = blocks_of(datasets, used)
    free = [name in FREE_IN_EACH_RECORDING for name in BASELINE_PARAMETERS[channel]]
    place, candidates = len(free), []
    for effect, shape, _, width in terms:
        places = tuple(range(place, place + width))
        place += width
        variants = _per_recording(effect, width, channel, len(datasets))
        candidates += [CandidateTerm(effect, shape, own, places) for own in variants]
    equations = BlockNormalEquations(free, candidates, recording_of_block, spare)
    for data, counts, block in zip(datasets, used, block_of, strict=True):
        kept = np.flatnonzero(counts)[:: stride(data.period_s)]
        rows = np.zeros((1 + place + spare, len(kept)))
        target, base = _target_and_baseline(data, channel, model_terms)
        rows[0] = target[kept]
        for number, column in _filtered_columns(data, base, terms):
            rows[1 + number] = column[kept]
        equations.add(rows, block[kept], settled_travel_m(data)[kept])
    equations.normalise()
    return RegressionProblem(
        channel=channel,
        datasets=datasets,
        equations=equations,
        terms=terms,
        used=used,
        block_of=block_of,
        model_terms=model_terms,
    )


def extended(problem: RegressionProblem, further: Sequence[TermKey]) -> RegressionProblem:
    """The problem with `further` terms in its spare columns, unnamed ones or of a shape that was not scanned.

    Columns of the others are not computed again. What was extended before is no longer valid.
    """
    known = {(one.effect, one.shape_parameters) for one in problem.terms}
    added, terms = list(problem.terms), []
    place = problem.equations.columns
    for effect, shape, own in further:
        columns_of_term = columns_of(effect, problem.channel)
        if (effect, shape) in known or columns_of_term is None:
            continue
        values = []
        for data, counts in zip(problem.datasets, problem.used, strict=True):
            kept, low_pass = np.flatnonzero(counts)[:: stride(data.period_s)], low_pass_of(data)
            columns = columns_of_term(data, shape)
            values.append(np.stack([low_pass(column)[kept] for column in columns.T]))
        width = len(values[0])
        added.append(TermColumns(effect, shape, columns_of_term, width))
        terms.append((CandidateTerm(effect, shape, own, tuple(range(place, place + width))), values))
        place += width
    return problem._replace(equations=problem.equations.extended(terms), terms=added) if terms else problem


def _target_and_baseline(
    data: RegressionData, channel: ResidualChannel, model_terms: Sequence[ModelTerm]
) -> tuple[Array, Array]:
    """Target (n,) less what the model predicts already, and the columns of the baseline (n, k)."""
    y, base = target_and_baseline(data, channel)
    if model_terms:
        y = y - low_pass_of(data)(predicted_by_model(data, channel, model_terms))
    return y, base


def _filtered_columns(
    data: RegressionData, base: Array, terms: Sequence[TermColumns]
) -> Iterator[tuple[int, Array]]:
    """Number and values (n,) of each column, baseline first; all but one term's are not in memory."""
    yield from enumerate(base.T)
    number, low_pass = base.shape[1], low_pass_of(data)
    for one in terms:
        columns = one.columns(data, one.shape_parameters)
        for k in range(one.width):
            yield number + k, low_pass(columns[:, k])
        number += one.width


def _terms(
    datasets: Sequence[RegressionData],
    channel: ResidualChannel,
    extra: Sequence[tuple[str, ShapeParameters]],
    *,
    only: bool,
) -> list[TermColumns]:
    """Named terms, then unnamed ones. Shape parameters that any recording can resolve are tried on all."""
    terms = []
    for effect in ENTRIES:
        if of := family(effect, channel):
            shapes = dict.fromkeys([] if only else of.shapes(datasets))
            shapes.update(dict.fromkeys(shape for name, shape in extra if name == effect))
            terms += [(effect, shape, of.columns) for shape in shapes]
    if not only:
        extra = [*((SINCE_REVERSAL, shape) for shape in term(SINCE_REVERSAL).shapes(datasets)), *extra]
    unnamed = dict.fromkeys((name, shape) for name, shape in extra if name.startswith(PREFIX))
    terms += [(name, shape, term(name).columns) for name, shape in unnamed]
    widths = [columns(datasets[0], shape).shape[1] for _, shape, columns in terms]
    return [TermColumns(*one, width) for one, width in zip(terms, widths, strict=True) if width > 0]


def _per_recording(effect: str, width: int, channel: ResidualChannel, recordings: int) -> Sequence[bool]:
    """Variants of a term: coefficients shared (False) or free in each recording (True)."""
    of = term(effect) if effect.startswith(PREFIX) else family(effect, channel)
    if has_levels(effect, width):
        return OWN
    return SHARED if recordings == 1 or of is None else of.per_recording
