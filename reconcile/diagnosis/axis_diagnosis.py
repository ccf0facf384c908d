"""One axis of a diagnosis: its channels are explained, tested on left-out recordings, and written."""

from collections.abc import Callable, Sequence
from functools import cache, partial
from typing import NamedTuple

from reconcile.catalogue.backlash import ENTRY as BACKLASH
from reconcile.catalogue.drive_compliance import ENTRY as DRIVE_COMPLIANCE
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.identification.explain import Explanation, explain
from reconcile.identification.motion_of_mass import motion_of_mass
from reconcile.identification.term_search import TermSearch
from reconcile.identification.unexplained_residual import is_misfit, varying_rms
from reconcile.model_update.axis_update import update_axis
from reconcile.model_update.shared_values import Sections
from reconcile.nominal_model.model_file import NominalModel
from reconcile.proof.model_choice import (
    best_predicting,
    with_refitted_values,
    without_dropped,
    writable_model,
)
from reconcile.proof.model_variants import AS_FOUND
from reconcile.proof.model_variants import NOTES as VARIANT_NOTES
from reconcile.proof.proof import Proof
from reconcile.proof.prove import prove
from reconcile.proof.simulated_model import simulated_recordings, without_simulated_terms
from reconcile.recording.recording import AxisRecording
from reconcile.regression.regression_problem import SINCE_REVERSAL
from reconcile.selection.selection_rules import SelectionRules

DEVIATION_LEAST_GAIN = 0.2
"""Least share of squares that a term explains in the deviation, where the drift of a scale resembles a term.
Chosen; not calibrated.
"""


class AxisDiagnosis(NamedTuple):
    """Results of the diagnosis of one axis."""

    explanations: list[Explanation]
    """One for each residual channel."""
    proofs: list[Proof]
    """In their order; empty without a proof."""
    sections: Sections
    """Of the axis' table in the model file, in the file's units."""
    notes: list[str]


def diagnose_axis(
    recordings: Sequence[AxisRecording],
    model: NominalModel,
    negligible_force_share: float,
    on_progress: Callable[[str], None],
    *,
    with_proof: bool,
) -> AxisDiagnosis:
    """Explain each channel of an axis, test the model on left-out recordings, and make its file's sections.

    `recordings` are all of one axis.
    """
    name = recordings[0].axis
    axis = model.axes[name]
    searches, found = _explain_channels(recordings, axis, negligible_force_share, on_progress)
    along_recordings = cache(partial(simulated_recordings, recordings, model))  # seconds; most need none

    def without_own_terms(of: Sequence[Explanation]) -> list[Explanation]:
        simulated = along_recordings() if any(map(_may_be_of_the_model, of)) else []
        return [without_simulated_terms(one, simulated, axis) for one in of]

    found = without_own_terms(found)
    proofs: list[Proof] = []
    if with_proof:
        on_progress(f"axis {name}: proof")
        proofs = prove(recordings, searches, found, model)
    del searches  # their columns take most of the memory
    dropped = [proof.dropped for proof in proofs] or [() for _ in found]
    reported, written = found, found
    if proofs:
        reported = [without_dropped(one, proof) for one, proof in zip(found, proofs, strict=True)]
        written = [best_predicting(one, proof) for one, proof in zip(found, proofs, strict=True)]
    reported = without_own_terms(reported)
    written, sections = writable_model(written, model, name)
    written = without_own_terms(written)
    written = (
        [with_refitted_values(*pair) for pair in zip(written, proofs, strict=True)] if proofs else written
    )
    updated = update_axis(written, model, name)
    explanations = [
        as_reported(one, whole)._replace(selected=None)  # its columns take most of the memory
        for one, whole in zip(updated.explanations, reported, strict=True)
    ]
    left_out = [note for effect, note in sections.left_out.items() if note not in updated.notes]
    notes = [
        f"model.toml, axis {name}: it does without {effect}: with it, what was left out was predicted no "
        "better than a rigid one"
        for effects in dropped
        for effect in effects
    ]
    notes += [f"model.toml, axis {name}: {VARIANT_NOTES[p.variant]}" for p in proofs if p.variant != AS_FOUND]
    return AxisDiagnosis(explanations, proofs, updated.sections, [*updated.notes, *left_out, *notes])


def _explain_channels(
    recordings: Sequence[AxisRecording],
    axis: NominalAxis,
    negligible_force_share: float,
    on_progress: Callable[[str], None],
) -> tuple[list[TermSearch], list[Explanation]]:
    """Explain the position deviation of the recordings that have a scale, and the force along the mass.

    Returned in the order of the channels: the force first.
    """
    name = recordings[0].axis
    searches: list[TermSearch] = []
    found: list[Explanation] = []
    with_scale = [recording for recording in recordings if recording.scale_m is not None]
    if with_scale:
        on_progress(f"axis {name}: scale less motor")
        rules = SelectionRules(least_gain=DEVIATION_LEAST_GAIN)
        searches.append(TermSearch(with_scale, axis, ResidualChannel.POSITION_DEVIATION, rules))
        found.append(explain(searches[0]))
    on_progress(f"axis {name}: force")
    rules = SelectionRules(negligible_force_share=negligible_force_share)
    along_mass = motion_of_mass(recordings, axis, found[0].selected if found else None).recordings
    searches.insert(0, TermSearch(along_mass, axis, ResidualChannel.FORCE, rules))
    found.insert(0, explain(searches[0]))
    if with_scale:
        found = [_without_cross_channel_misfit(one, found, axis) for one in found]
    return searches, found


def _may_be_of_the_model(explanation: Explanation) -> bool:
    """Whether there is a finding that a simulation of the model might show as well."""
    sizes = explanation.accounted
    return bool(explanation.findings) or explanation.nominal_is_worse or not (sizes and sizes.is_noise)


def as_reported(written: Explanation, reported: Explanation) -> Explanation:
    """The explanation that is written, with the findings of the one that is reported.

    What the written model has beside what was identified, as textbook friction, is no finding, nor is an
    effect that was minor beside what was identified. What nothing explains is that of the written model.
    """
    names = {f.effect for f in reported.findings}
    findings = [
        f for f in written.findings if f.effect in names or (f.effect == "unknown" and not f.candidates)
    ]
    minor = [*written.minor, *(f for f in written.findings if f not in findings)]
    own = {f.effect for f in [*findings, *minor]}
    return written._replace(
        findings=[*findings, *(f for f in reported.findings if f.effect not in own)],
        minor=[*minor, *(f for f in reported.minor if f.effect not in own)],
        withdrawn=reported.withdrawn,
    )


def _without_cross_channel_misfit(
    one: Explanation, found: Sequence[Explanation], axis: NominalAxis
) -> Explanation:
    """The explanation without the traces in this channel of effects that are named in another one.

    These are an unexplained residual that is their misfit; and, where the model has or another channel names
    a spring or backlash, the unnamed term after each reversal: the motor's force there resembles presliding.
    """
    named = {f.effect for other in found if other is not one for f in other.findings} - {"unknown"}
    findings, minor = list(one.findings), list(one.minor)
    if named and one.accounted and is_misfit(one.channel, one.accounted, varying_rms(one.residuals)):
        findings = [f for f in findings if f.effect != "unknown" or f.candidates]
    if {*named, *axis.model_effects.effects} & {BACKLASH.name, DRIVE_COMPLIANCE.name}:
        images = [f for f in findings if any(c.effect == SINCE_REVERSAL for c in f.candidates)]
        findings, minor = [f for f in findings if f not in images], [*minor, *images]
    return one._replace(findings=findings, minor=minor)
