"""Leave-one-recording-out: the model file that the other recordings give is written, loaded and tested.

Of an only recording the last third is left out, and predicted from the first two thirds.
"""

import math
import tempfile
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array, Index
from kernels.compiler_memory import release_compiler
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.formats.nominal_axis import NominalAxis, baseline_parameters
from reconcile.identification.explain import Explanation, explain, without
from reconcile.identification.findings import IdentifiedEffect
from reconcile.identification.term_search import TermSearch
from reconcile.model_update.axis_sections import AxisSections, axis_sections
from reconcile.nominal_model.model_file import NominalModel, load_model, write_model
from reconcile.proof.model_variants import AS_FOUND, OF_ALL_RECORDINGS, VARIANTS, has_own, variants_of
from reconcile.proof.proof import LEAST_BETTER, LeftOut, Proof
from reconcile.proof.written_model import written_residual
from reconcile.recording.recording import AxisRecording
from reconcile.regression.residual import without_traces
from reconcile.selection.predictive_terms import WithdrawnEffect

LAST_SHARE = 1.0 / 3.0
"""Share of an only recording that is left out."""


def prove(
    recordings: Sequence[AxisRecording],
    searches: Sequence[TermSearch],
    explanations: Sequence[Explanation],
    model: NominalModel,
    on_progress: Callable[[str], None] = lambda _text: None,
) -> list[Proof]:
    """Leave each recording of an axis out in turn; return a proof for each channel that was searched.

    `explanations`: of all recordings, in the order of the searches. Releases the searches' columns.
    """
    folds: list[_Fold] = []
    for number, recording in enumerate(recordings, start=1):
        on_progress(f"axis {recording.axis}: {number} of {len(recordings)} recordings left out")
        release_compiler()  # what the last search has freed is for the columns of the next
        blocks = [_blocks_of(search, recording.source) for search in searches]
        of_others = [
            _without_samples(explain(search, of)) for search, of in zip(searches, blocks, strict=True)
        ]
        folds.append(_Fold(recording, blocks, of_others))
    for search in searches:
        search.release()
    choices = {search.channel: _ModelChoice((), AS_FOUND) for search in searches}
    return [
        _chosen_proof(folds, place, search, explanation, model=model, choices=choices)
        for place, (search, explanation) in enumerate(zip(searches, explanations, strict=True))
    ]


def _chosen_proof(
    folds: Sequence["_Fold"],
    place: int,
    search: TermSearch,
    explanation: Explanation,
    *,
    model: NominalModel,
    choices: dict[ResidualChannel, "_ModelChoice"],
) -> Proof:
    """Choose the model of a channel that predicts best, set it in `choices`, and return its proof.

    Effects are dropped, the least valuable first, until the written model predicts better than the rigid one.
    Then each variant replaces it if it predicts clearly better.
    """
    channel, of_folds = search.channel, [fold.of_others[place] for fold in folds]
    if has_own(explanation) and not any(map(has_own, of_folds)):
        # the folds have too few recordings to test a fit beside terms of one recording
        choices[channel] = _ModelChoice((), OF_ALL_RECORDINGS)
    assess = partial(_proof, folds, place, search, model, choices)
    droppable = _least_valuable_first(explanation, of_folds)
    while not (proof := assess()).improves and droppable:
        own = choices[channel]
        choices[channel] = own._replace(dropped=(*own.dropped, droppable.pop(0)))
    for variant in variants_of(explanation):
        before = choices[channel]
        choices[channel] = before._replace(variant=variant)
        other = assess()
        if other.written < LEAST_BETTER * proof.written:
            proof = other
        else:
            choices[channel] = before
    return proof


def _least_valuable_first(explanation: Explanation, of_folds: Sequence[Explanation]) -> list[str]:
    """Effects in the order in which they are dropped: those that only folds have, then by held-out gain."""
    of_all = [f.effect for f in sorted(_writable(explanation), key=lambda f: f.heldout_gain)]
    only_in_folds = [f.effect for one in of_folds for f in _writable(one) if f.effect not in of_all]
    return list(dict.fromkeys([*only_in_folds, *of_all]))


def _without_samples(explanation: Explanation) -> Explanation:
    """The terms and values of an explanation, without the columns and residuals over time."""
    if explanation.found is not None:
        explanation.found.problem.equations.rows.clear()
    return explanation._replace(residuals=[without_traces(one) for one in explanation.residuals])


def _proof(
    folds: Sequence["_Fold"],
    place: int,
    search: TermSearch,
    model: NominalModel,
    choices: Mapping[ResidualChannel, "_ModelChoice"],
) -> Proof:
    """Errors of the written and of the rigid model on each recording that was left out."""
    parts = [_errors(fold, place, search, model, choices) for fold in folds if len(fold.blocks[place])]
    own = choices[search.channel]
    return Proof(search.channel, parts, len(search.sources) == 1, own.dropped, own.variant)


def _writable(explanation: Explanation) -> list[IdentifiedEffect]:
    """The findings that a model file can hold: all but unnamed terms that each recording has of its own."""
    return [
        f
        for f in [*explanation.findings, *explanation.minor]
        if f.effect != "unknown" or not all(c.per_recording for c in f.candidates)
    ]


def best_predicting(explanation: Explanation, proof: Proof) -> Explanation:
    """The explanation as the model that predicted best: without dropped effects, in the chosen variant."""
    return _ModelChoice(proof.dropped, proof.variant).applied_to(explanation, brief=False)


def without_dropped(explanation: Explanation, proof: Proof) -> Explanation:
    """The explanation without the effects that the proof dropped, which are withdrawn.

    An effect with a phase of its own in each recording is still reported: no file can hold its phase.
    """
    own_phase = {
        finding.effect
        for finding in [*explanation.findings, *explanation.minor]
        if any(candidate.per_recording for candidate in finding.candidates)
    }
    dropped = [name for name in proof.dropped if name not in {*own_phase, "unknown"}]
    found = {finding.effect for finding in [*explanation.findings, *explanation.minor]}
    why = "the model that holds it predicts what was left out no better than a rigid one"
    more = [WithdrawnEffect(name, why) for name in dropped if name in found]
    kept = without(explanation, dropped)
    return kept._replace(withdrawn=(*explanation.withdrawn, *more))


class _ModelChoice(NamedTuple):
    """Which model of a channel is written."""

    dropped: tuple[str, ...]
    """Effects that it does without."""
    variant: str
    """A key of VARIANTS."""

    def applied_to(self, explanation: Explanation, *, brief: bool = True) -> Explanation:
        return VARIANTS[self.variant](without(explanation, self.dropped, brief=brief), brief)


class _Fold(NamedTuple):
    """One recording left out, and the explanations of the others."""

    recording: AxisRecording
    blocks: list[Index]
    """By channel: the blocks that are left out."""
    of_others: list[Explanation]
    """By channel: identified without those blocks."""


def _blocks_of(search: TermSearch, source: str) -> Index:
    """Blocks of the recording that is left out; of an only one, those of its last third."""
    if source not in search.sources:
        return np.zeros(0, dtype=np.int64)
    of = search.problem.equations.recording_of_block
    own = np.flatnonzero(of == search.sources.index(source))
    return own if len(search.sources) > 1 else own[math.floor(len(own) * (1.0 - LAST_SHARE)) :]


def written_explanations(
    explanations: Sequence[Explanation], model: NominalModel, name: str, *, brief: bool = False
) -> tuple[list[Explanation], AxisSections]:
    """The explanations refitted without the effects that no file can hold, and their sections of the file."""
    sections = axis_sections(explanations, model, name)
    if not sections.left_out:
        return list(explanations), sections
    writable = [without(one, sections.left_out, brief=brief) for one in explanations]
    return writable, axis_sections(writable, model, name)._replace(left_out=sections.left_out)


def _written_axis(explanations: Sequence[Explanation], model: NominalModel, name: str) -> NominalAxis:
    """The axis as read from the model file that is written from the explanations."""
    sections = written_explanations(explanations, model, name, brief=True)[1].sections
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "model.toml"
        write_model(model, {name: sections}, file)
        return load_model(file).axes[name]


def _errors(
    fold: _Fold,
    place: int,
    search: TermSearch,
    model: NominalModel,
    choices: Mapping[ResidualChannel, _ModelChoice],
) -> LeftOut:
    """Errors of the written and of the rigid model in the blocks that were left out."""
    recording, blocks, of_channel = fold.recording, fold.blocks[place], fold.of_others[place]
    chosen = [choices[one.channel].applied_to(one) for one in fold.of_others]
    written, rigid = _written_axis(chosen, model, recording.axis), model.axes[recording.axis]
    if of_channel.rigid:
        rigid = _with_base(rigid, of_channel.rigid)
    of_written, of_rigid = (
        written_residual(recording, axis, search.channel, of_channel.timing_s) for axis in (written, rigid)
    )
    number = search.sources.index(recording.source)
    used = of_written.used & np.isin(search.problem.block_of[number], blocks)
    return LeftOut(
        source=recording.source,
        channel=search.channel,
        samples=int(used.sum()),
        measured=_rms(of_written.measured[used]),
        rigid=_rms(of_rigid.residual[used]),
        written=_rms(of_written.residual[used]),
    )


def _with_base(axis: NominalAxis, values: Mapping[str, float]) -> NominalAxis:
    """The axis with mass and friction as fitted, less the part of each that effects of the model carry."""
    of_model = baseline_parameters(axis)
    return axis._replace(
        mass_kg=axis.mass_kg + values["mass_kg"] - of_model["mass_kg"],
        viscous_n_s_m=values["viscous_n_s_m"],
        coulomb_n=axis.coulomb_n + values["coulomb_n"] - of_model["coulomb_n"],
    )


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0
