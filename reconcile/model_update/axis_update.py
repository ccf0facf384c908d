"""The update of an axis by the identified effects, refined by the two-mass model along the recordings."""

from collections.abc import Sequence
from typing import NamedTuple

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.errors import ReconcileError
from reconcile.identification.explain import Explanation
from reconcile.identification.two_mass import TwoMassModel, identify_two_mass
from reconcile.model_update.axis_sections import AxisSections, axis_sections
from reconcile.model_update.shared_values import Sections
from reconcile.model_update.two_mass_results import summary_note, two_mass_results
from reconcile.nominal_model.model_file import NominalModel
from reconcile.replay.replay import plant_of

SPRING = "drive_compliance"


class AxisUpdate(NamedTuple):
    """The update of one axis."""

    sections: Sections
    """Sections of the axis in a plant file, in its units."""
    notes: list[str]
    """Effects that could not be written as identified, and the result of the two-mass model."""
    explanations: list[Explanation]
    """Explanations with the residuals of the updated plant."""


def update_axis(explanations: Sequence[Explanation], model: NominalModel, name: str) -> AxisUpdate:
    """Return the update of an axis; a new spring or backlash is identified by output error."""
    made = axis_sections(explanations, model, name)
    if SPRING not in made.sections:
        return AxisUpdate(made.sections, made.notes, list(explanations))
    if all(
        explanation.channel is ResidualChannel.FORCE for explanation in explanations
    ) or _explained_by_motor(explanations):
        return AxisUpdate(made.sections, made.notes, list(explanations))  # the motor alone explains all of it
    note, why = f"model.toml, axis {name}: {SPRING}: ", "the recordings do not tell it"
    try:
        found = _two_mass(explanations, model, name, made)
    except ReconcileError as refused:
        found, why = None, refused.reason
    if found is None:
        notes = [*made.notes, f"{note}its damping is a guess: {why}"]
        return AxisUpdate(made.sections, notes, list(explanations))
    sections = dict(made.sections)
    fitted, after = two_mass_results(found, explanations, model.axes[name].lead_m)
    for section, values in fitted.items():
        sections[section] = {**sections.get(section, {}), **values}
    named = {finding.effect for one in after for finding in [*one.findings, *one.minor]}
    needless = {why for effect, why in made.left_out.items() if effect not in named}
    notes = [one for one in made.notes if one not in needless]
    return AxisUpdate(sections, [*notes, note + summary_note(found)], after)


def _explained_by_motor(explanations: Sequence[Explanation]) -> bool:
    """Return whether the motor force identifies the spring with the masses on either side."""
    return any(
        finding.effect == SPRING and "load_mass_kg" in finding.parameters
        for explanation in explanations
        for finding in [*explanation.findings, *explanation.minor]
    )


def _two_mass(
    explanations: Sequence[Explanation], model: NominalModel, name: str, made: AxisSections
) -> TwoMassModel | None:
    deviation = next((e for e in explanations if e.channel.value == "deviation"), None)
    if deviation is None:
        return None
    return identify_two_mass(
        plant_of(model, {name: made.sections}),
        name,
        deviation,
        play="backlash" in made.sections,
        free_spring=all(f.effect != SPRING for f in [*deviation.findings, *deviation.minor]),
        own_rotor=model.axes[name].motor_mass_kg > 0.0,
    )
