"""Which model of a channel is written: a variant of the identified effects, without some of them."""

from collections.abc import Sequence
from typing import NamedTuple

from reconcile.identification.explain import Explanation, without
from reconcile.identification.findings import IdentifiedEffect
from reconcile.model_update.axis_sections import AxisSections, axis_sections
from reconcile.nominal_model.model_file import NominalModel
from reconcile.proof.model_variants import VARIANTS
from reconcile.proof.proof import BETTER_RMS_RATIO, Proof
from reconcile.selection.predictive_terms import WithdrawnEffect


class ModelChoice(NamedTuple):
    """Which model of a channel is written."""

    dropped: tuple[str, ...]
    """Effects that the model does without."""
    variant: str
    """A key of VARIANTS."""

    def applied_to(self, explanation: Explanation, *, parameters_only: bool = True) -> Explanation:
        """The explanation without the dropped effects, in the variant."""
        return VARIANTS[self.variant](
            without(explanation, self.dropped, parameters_only=parameters_only), parameters_only
        )


def best_predicting(explanation: Explanation, proof: Proof) -> Explanation:
    """The explanation as the model that predicted best: without dropped effects, in the chosen variant."""
    return ModelChoice(proof.dropped, proof.variant).applied_to(explanation, parameters_only=False)


def with_refitted_values(explanation: Explanation, proof: Proof) -> Explanation:
    """The explanation whose nominal values are not written where refitted ones predicted better."""
    is_noise = explanation.accounted is not None and explanation.accounted.is_noise
    if proof.rigid < BETTER_RMS_RATIO * proof.written and not is_noise:
        return explanation._replace(nominal_is_worse=True)
    return explanation


def without_dropped(explanation: Explanation, proof: Proof) -> Explanation:
    """The explanation without the effects that the proof dropped, which are withdrawn.

    An effect with a phase of its own in each recording is still reported: no file can hold its phase.
    """
    effects = [*explanation.findings, *explanation.minor]
    with_own_phase = {
        effect.effect for effect in effects if any(term.per_recording for term in effect.candidates)
    }
    dropped = [name for name in proof.dropped if name not in {*with_own_phase, "unknown"}]
    identified = {effect.effect for effect in effects}
    why = "the model that holds it predicts what was left out no better than a rigid one"
    withdrawn = [WithdrawnEffect(name, why) for name in dropped if name in identified]
    kept = without(explanation, dropped)
    return kept._replace(withdrawn=(*explanation.withdrawn, *withdrawn))


def dropping_order(explanation: Explanation, of_folds: Sequence[Explanation]) -> list[str]:
    """Effects in the order in which they are dropped: those that only folds have, then by held-out gain."""
    by_gain = [e.effect for e in sorted(_writable_effects(explanation), key=lambda e: e.heldout_gain)]
    only_in_folds = [
        e.effect for fold in of_folds for e in _writable_effects(fold) if e.effect not in by_gain
    ]
    return list(dict.fromkeys([*only_in_folds, *by_gain]))


def _writable_effects(explanation: Explanation) -> list[IdentifiedEffect]:
    """The effects that a model file can hold: all but unnamed terms that each recording has of its own."""
    return [
        effect
        for effect in [*explanation.findings, *explanation.minor]
        if effect.effect != "unknown" or not all(term.per_recording for term in effect.candidates)
    ]


class WritableModel(NamedTuple):
    """What of an axis's explanations a model file holds."""

    explanations: list[Explanation]
    """By channel, refitted without the effects that no file can hold."""
    sections: AxisSections


def writable_model(
    explanations: Sequence[Explanation], model: NominalModel, axis: str, *, parameters_only: bool = False
) -> WritableModel:
    """The explanations of an axis without the effects that no file can hold, and its sections of the file."""
    sections = axis_sections(explanations, model, axis)
    if not sections.left_out:
        return WritableModel(list(explanations), sections)
    writable = [
        without(explanation, sections.left_out, parameters_only=parameters_only)
        for explanation in explanations
    ]
    sections_of_writable = axis_sections(writable, model, axis)
    return WritableModel(writable, sections_of_writable._replace(left_out=sections.left_out))
