"""Each recording left out in turn: what the others tell, written, loaded, and compared with it.

An only recording is judged on its last third by what the first two thirds tell.
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
from reconcile.selection.left_out import Withdrawn

LAST_SHARE = 1.0 / 3.0
"""Share of an only recording that is left out."""


def prove(
    recordings: Sequence[AxisRecording],
    searches: Sequence[TermSearch],
    explanations: Sequence[Explanation],
    model: NominalModel,
    on_progress: Callable[[str], None] = lambda _text: None,
) -> list[Proof]:
    """Leave each recording of an axis out in turn; a proof for each channel that was searched.

    `explanations`, of all recordings, in the order of the searches: effects that make the written model
    predict worse than the rigid one are dropped, the one that is worth least first. Then the variants of it
    compete. Nothing can be searched after it.
    """
    folds: list[_Fold] = []
    for number, recording in enumerate(recordings, start=1):
        on_progress(f"axis {recording.axis}: {number} of {len(recordings)} recordings left out")
        release_compiler()  # what the last search has freed is for the columns of the next
        blocks = [_blocks_of(search, recording.source) for search in searches]
        made = [_to_be_kept(explain(search, of)) for search, of in zip(searches, blocks, strict=True)]
        folds.append(_Fold(recording, blocks, made))
    for search in searches:
        search.release()
    written = {search.channel: _Written((), AS_FOUND) for search in searches}
    proofs: list[Proof] = []
    for place, (search, explanation) in enumerate(zip(searches, explanations, strict=True)):
        of_all = sorted(_in_the_file(explanation), key=lambda f: f.heldout_gain)
        of_folds = [f for fold in folds for f in _in_the_file(fold.made[place])]
        known = [f.effect for f in of_all]
        remaining = [*(f.effect for f in of_folds if f.effect not in known), *known]
        remaining = list(dict.fromkeys(remaining))
        if has_own(explanation) and not any(has_own(fold.made[place]) for fold in folds):
            # too few recordings tell whether the rest is better fitted beside it
            written[search.channel] = _Written((), OF_ALL_RECORDINGS)
        judged = partial(_proof, folds, place, search, model, written)
        while not (proof := judged()).improves and remaining:
            own = written[search.channel]
            written[search.channel] = own._replace(dropped=(*own.dropped, remaining.pop(0)))
        for variant in variants_of(explanation):
            before = written[search.channel]
            written[search.channel] = before._replace(variant=variant)
            other = judged()
            if other.written < LEAST_BETTER * proof.written:
                proof = other
            else:
                written[search.channel] = before
        proofs.append(proof)
    return proofs


def _to_be_kept(explanation: Explanation) -> Explanation:
    """What is written of a part: its names and values, without the traces over time."""
    if explanation.found is not None:
        explanation.found.problem.equations.rows.clear()
    return explanation._replace(residuals=[without_traces(one) for one in explanation.residuals])


def _proof(
    folds: Sequence["_Fold"],
    place: int,
    search: TermSearch,
    model: NominalModel,
    written: Mapping[ResidualChannel, "_Written"],
) -> Proof:
    """What the written model leaves of each recording that was left out."""
    parts = [_judged(fold, place, search, model, written) for fold in folds if len(fold.blocks[place])]
    own = written[search.channel]
    return Proof(search.channel, parts, len(search.sources) == 1, own.dropped, own.variant)


def _in_the_file(explanation: Explanation) -> list[IdentifiedEffect]:
    """What was found, but for what each recording has of its own without a name: no file has it."""
    return [
        f
        for f in [*explanation.findings, *explanation.minor]
        if f.effect != "unknown" or not all(c.per_recording for c in f.candidates)
    ]


def to_be_written(explanation: Explanation, proof: Proof) -> Explanation:
    """The model of the explanation that predicted best."""
    return _Written(proof.dropped, proof.variant).of(explanation, brief=False)


def proven(explanation: Explanation, proof: Proof) -> Explanation:
    """The explanation without the effects that the proof dropped, which are withdrawn.

    An effect with a phase of its own in each recording keeps its name: no file can hold its phase.
    """
    own_phase = {
        finding.effect
        for finding in [*explanation.findings, *explanation.minor]
        if any(candidate.per_recording for candidate in finding.candidates)
    }
    dropped = [name for name in proof.dropped if name not in {*own_phase, "unknown"}]
    found = {finding.effect for finding in [*explanation.findings, *explanation.minor]}
    why = "the model that holds it predicts what was left out no better than a rigid one"
    more = [Withdrawn(name, why) for name in dropped if name in found]
    kept = without(explanation, dropped)
    return kept._replace(withdrawn=(*explanation.withdrawn, *more))


class _Written(NamedTuple):
    """What of a channel is written."""

    dropped: tuple[str, ...]
    variant: str

    def of(self, explanation: Explanation, *, brief: bool = True) -> Explanation:
        return VARIANTS[self.variant](without(explanation, self.dropped, brief=brief), brief)


class _Fold(NamedTuple):
    """One recording left out, and what the others tell."""

    recording: AxisRecording
    blocks: list[Index]
    """By channel: what is left out."""
    made: list[Explanation]


def _blocks_of(search: TermSearch, source: str) -> Index:
    """Blocks of the recording that is left out; of an only one, those of its last third."""
    if source not in search.sources:
        return np.zeros(0, dtype=np.int64)
    of = search.problem.equations.recording_of_block
    own = np.flatnonzero(of == search.sources.index(source))
    return own if len(search.sources) > 1 else own[math.floor(len(own) * (1.0 - LAST_SHARE)) :]


def written_explanations(
    made: Sequence[Explanation], model: NominalModel, name: str, *, brief: bool = False
) -> tuple[list[Explanation], AxisSections]:
    """The explanations fitted anew without what no file can hold, and the sections that they make."""
    sections = axis_sections(made, model, name)
    if not sections.left_out:
        return list(made), sections
    held = [without(one, sections.left_out, brief=brief) for one in made]
    return held, axis_sections(held, model, name)._replace(left_out=sections.left_out)


def _written_axis(made: Sequence[Explanation], model: NominalModel, name: str) -> NominalAxis:
    """The axis of the model file that the explanations make, written and read again."""
    sections = written_explanations(made, model, name, brief=True)[1].sections
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "model.toml"
        write_model(model, {name: sections}, file)
        return load_model(file).axes[name]


def _judged(
    fold: _Fold,
    place: int,
    search: TermSearch,
    model: NominalModel,
    written_of: Mapping[ResidualChannel, _Written],
) -> LeftOut:
    """The residuals of both models in the blocks that were left out."""
    recording, blocks = fold.recording, fold.blocks[place]
    kept = [written_of[made.channel].of(made) for made in fold.made]
    written, rigid = _written_axis(kept, model, recording.axis), model.axes[recording.axis]
    if values := fold.made[place].rigid:
        rigid = _with_base(rigid, values)
    ours, theirs = (
        written_residual(recording, axis, search.channel, fold.made[place].timing_s)
        for axis in (written, rigid)
    )
    number = search.sources.index(recording.source)
    used = ours.used & np.isin(search.problem.block_of[number], blocks)
    return LeftOut(
        source=recording.source,
        channel=search.channel,
        samples=int(used.sum()),
        measured=_rms(ours.measured[used]),
        rigid=_rms(theirs.left[used]),
        written=_rms(ours.left[used]),
    )


def _with_base(axis: NominalAxis, values: Mapping[str, float]) -> NominalAxis:
    """The axis with mass and friction as fitted; effects of the model that carry some of either keep it."""
    held = baseline_parameters(axis)
    return axis._replace(
        mass_kg=axis.mass_kg + values["mass_kg"] - held["mass_kg"],
        viscous_n_s_m=values["viscous_n_s_m"],
        coulomb_n=axis.coulomb_n + values["coulomb_n"] - held["coulomb_n"],
    )


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0
