"""Leave-one-recording-out: the model file that the other recordings give is written, loaded and tested.

Of a single recording the last third is left out, and predicted from the first two thirds. Whether single
effects predict a left-out recording is tested earlier, during their selection (`selection.predictive_terms`).
"""

import math
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array, Index, rms
from kernels.heap import trim_heap
from reconcile.catalogue.conversion import ModelTerm
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.catalogue.transport_delay import ENTRY as TRANSPORT_DELAY
from reconcile.formats.nominal_axis import NominalAxis, baseline_parameters
from reconcile.identification.explain import Explanation, explain
from reconcile.identification.model_force import with_identified_force
from reconcile.identification.motion_of_mass import along_model
from reconcile.identification.term_search import TermSearch
from reconcile.nominal_model.model_file import NominalModel, load_model, write_model
from reconcile.proof.model_choice import ModelChoice, dropping_order, writable_model
from reconcile.proof.model_variants import (
    AS_FOUND,
    OF_ALL_RECORDINGS,
    OVER_POSITION,
    has_unnamed_per_recording,
    variants_of,
)
from reconcile.proof.proof import HeldOutErrors, Proof
from reconcile.recording.recording import AxisRecording
from reconcile.regression.model_presliding import regressed_terms
from reconcile.regression.regression_data import regression_data, samples_in_use, target_and_baseline
from reconcile.regression.regression_problem import regression_problem
from reconcile.regression.residual import without_traces


class ModelResidual(NamedTuple):
    """Residual of a model on one recording in one channel; arrays (n,), N or m."""

    measured: Array
    """The filtered channel itself."""
    residual: Array
    used: NDArray[np.bool_]
    """Samples that count."""


def written_residual(
    recording: AxisRecording, axis: NominalAxis, channel: ResidualChannel, timing_s: float = 0.0
) -> ModelResidual:
    """Return the residual of a model as written on a recording, behind the filter of the diagnosis.

    `timing_s`: delay between force and position samples. Only the zero of a scale against its motor, which
    changes with each power-up, is fitted for the recording.
    """
    is_force = channel is ResidualChannel.FORCE
    data = regression_data(along_model(recording, axis) if is_force else recording, axis)
    terms = regressed_terms(axis, [data], channel)
    if timing_s and is_force:
        terms = [*terms, ModelTerm(TRANSPORT_DELAY.name, (timing_s,), (1.0,))]
    baseline = [0.0, 0.0]
    if is_force:
        baseline = list(baseline_parameters(axis).values())
        with_measured_force = regression_problem([data], channel, only=True, model_terms=terms)
        slots = with_measured_force.equations.slots([])
        # terms that depend on the force use that of the model, which the measured one would falsify
        data = with_identified_force(with_measured_force, 0, slots, np.array(baseline))
    problem = regression_problem([data], channel, only=True, model_terms=terms)
    target, columns = problem.target_and_columns(0)
    residual = target - columns @ np.array(baseline)
    used = samples_in_use(data, channel)
    if not is_force:
        residual = residual - residual[used].mean()
    return ModelResidual(target_and_baseline(data, channel)[0], residual, used)


LEFT_OUT_SHARE = 1.0 / 3.0
"""Share of a single recording that is left out, at its end; chosen."""


def prove(
    recordings: Sequence[AxisRecording],
    searches: Sequence[TermSearch],
    explanations: Sequence[Explanation],
    model: NominalModel,
) -> list[Proof]:
    """Leave each recording of an axis out in turn; return a proof for each channel that was searched.

    `explanations`: of all recordings, in the order of the searches. Releases the searches' columns.
    """
    folds: list[_Fold] = []
    for recording in recordings:
        trim_heap()  # the columns of the next search use the memory that the last one has freed
        blocks = [_held_out_blocks(search, recording.source) for search in searches]
        of_others = [
            _without_samples(explain(search, left_out))
            for search, left_out in zip(searches, blocks, strict=True)
        ]
        folds.append(_Fold(recording, blocks, of_others))
    for search in searches:
        search.release()
    choosing = _ModelChoosing(folds, searches, model)
    return [choosing.choose(number, explanation) for number, explanation in enumerate(explanations)]


class _Fold(NamedTuple):
    """One recording left out, and the explanations of the others; lists by channel."""

    recording: AxisRecording
    blocks: list[Index]
    """Those that are left out."""
    of_others: list[Explanation]
    """Identified without those blocks."""


class _ModelChoosing:
    """Chooses the written model channel by channel, by its errors on what was left out.

    A channel is a number here: its place in `searches`.
    """

    def __init__(self, folds: Sequence[_Fold], searches: Sequence[TermSearch], model: NominalModel) -> None:
        self._folds, self._searches, self._model = folds, searches, model
        self._choices = [ModelChoice((), AS_FOUND) for _ in searches]

    def choose(self, channel: int, explanation: Explanation) -> Proof:
        """Choose the model of a channel that predicts best, and return its proof.

        Effects are dropped, the least valuable first, until the written model predicts better than the rigid
        one. Then each variant replaces it if it predicts clearly better.
        """
        choices, of_folds = self._choices, [fold.of_others[channel] for fold in self._folds]
        if has_unnamed_per_recording(explanation) and not any(map(has_unnamed_per_recording, of_folds)):
            # the folds have too few recordings to test a fit beside terms of one recording
            choices[channel] = ModelChoice((), OF_ALL_RECORDINGS)
        droppable = dropping_order(explanation, of_folds)
        while not (proof := self._proof(channel)).improves and droppable:
            choice = choices[channel]
            choices[channel] = choice._replace(dropped=(*choice.dropped, droppable.pop(0)))
        for variant in variants_of(explanation):
            previous = choices[channel]
            choices[channel] = previous._replace(variant=variant)
            proof_of_variant = self._proof(channel)
            if proof_of_variant.is_better_than(proof, by_standard_error=variant in OVER_POSITION):
                proof = proof_of_variant
            else:
                choices[channel] = previous
        return proof

    def _proof(self, channel: int) -> Proof:
        """Errors of the written and of the rigid model on each recording that was left out."""
        parts = [self._errors(fold, channel) for fold in self._folds if len(fold.blocks[channel])]
        search, choice = self._searches[channel], self._choices[channel]
        return Proof(search.channel, parts, len(search.sources) == 1, choice.dropped, choice.variant)

    def _errors(self, fold: _Fold, channel: int) -> HeldOutErrors:
        """Errors of the written and of the rigid model in the blocks that were left out."""
        search, recording, of_channel = self._searches[channel], fold.recording, fold.of_others[channel]
        chosen = [
            choice.applied_to(explanation)
            for choice, explanation in zip(self._choices, fold.of_others, strict=True)
        ]
        written = _written_axis(chosen, self._model, recording.axis)
        rigid = self._model.axes[recording.axis]
        if of_channel.rigid:
            rigid = _with_rigid_parameters(rigid, of_channel.rigid)
        of_written, of_rigid = (
            written_residual(recording, axis, search.channel, of_channel.timing_s)
            for axis in (written, rigid)
        )
        number = search.sources.index(recording.source)
        used = of_written.used & np.isin(search.problem.block_of[number], fold.blocks[channel])
        return HeldOutErrors(
            source=recording.source,
            channel=search.channel,
            samples=int(used.sum()),
            measured=_rms(of_written.measured[used]),
            rigid=_rms(of_rigid.residual[used]),
            written=_rms(of_written.residual[used]),
        )


def _held_out_blocks(search: TermSearch, source: str) -> Index:
    """Blocks of the recording that is left out; of a single one, those of its last third."""
    if source not in search.sources:
        return np.zeros(0, dtype=np.int64)
    recording_of_block = search.problem.equations.recording_of_block
    blocks = np.flatnonzero(recording_of_block == search.sources.index(source))
    if len(search.sources) > 1:
        return blocks
    return blocks[math.floor(len(blocks) * (1.0 - LEFT_OUT_SHARE)) :]


def _without_samples(explanation: Explanation) -> Explanation:
    """The terms and values of an explanation, without the columns and residuals over time."""
    if explanation.selected is not None:
        explanation.selected.problem.equations.rows.clear()
    return explanation._replace(residuals=[without_traces(one) for one in explanation.residuals])


def _written_axis(explanations: Sequence[Explanation], model: NominalModel, axis: str) -> NominalAxis:
    """The axis as read from the model file that is written from the explanations."""
    sections = writable_model(explanations, model, axis, parameters_only=True).sections.sections
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "model.toml"
        write_model(model, {axis: sections}, file)
        return load_model(file).axes[axis]


def _with_rigid_parameters(axis: NominalAxis, fitted: Mapping[str, float]) -> NominalAxis:
    """The axis with mass and friction as fitted, less the part of each that effects of the model carry."""
    of_model = baseline_parameters(axis)
    return axis._replace(
        mass_kg=axis.mass_kg + fitted["mass_kg"] - of_model["mass_kg"],
        viscous_n_s_m=fitted["viscous_n_s_m"],
        coulomb_n=axis.coulomb_n + fitted["coulomb_n"] - of_model["coulomb_n"],
    )


def _rms(values: Array) -> float:
    return rms(values) if len(values) else 0.0
