"""The repair of an axis, and beyond it what only the whole plant along the recordings tells: `contact`."""

from collections.abc import Sequence
from typing import NamedTuple

from reconcile.errors import ReconcileError
from reconcile.identification.explain import Explanation
from reconcile.identification.two_mass import (
    ContactModel,
    fit_contact,
    plant_sections,
    summary_note,
    with_two_mass_force,
)
from reconcile.model_update.repairs import Repair, Sections, repair
from reconcile.nominal_model.model_file import NominalModel
from reconcile.replay.replay import plant_of

SPRING = "drive_compliance"


class Whole(NamedTuple):
    """What one axis gets."""

    sections: Sections
    """Of the axis' table in a plant file, in the file's units."""
    notes: list[str]
    """What could not be written as it was found, and what the whole plant told."""
    explanations: list[Explanation]
    """As this plant leaves the recordings."""


def repair_whole(explanations: Sequence[Explanation], model: NominalModel, name: str) -> Whole:
    """Sections for all that was found of an axis; a spring or a play that is new by output error."""
    made = repair(explanations, model, name)
    plain = Whole(made.sections, made.notes, list(explanations))
    if SPRING not in made.sections:
        return plain
    try:
        found = _contact(explanations, model, name, made)
    except ReconcileError as refused:
        return plain._replace(notes=[*made.notes, _said(name, f"its damping is a guess: {refused.reason}")])
    if found is None:
        why = "its damping is a guess: the recordings do not tell it"
        return plain._replace(notes=[*made.notes, _said(name, why)])
    sections = dict(made.sections)
    for section, values in plant_sections(found, model.axes[name].lead_m).items():
        sections[section] = {**sections.get(section, {}), **values}
    left = with_two_mass_force(found, explanations)
    named = {finding.effect for one in left for finding in [*one.findings, *one.minor]}
    needless = {why for effect, why in made.left_out.items() if effect not in named}
    notes = [said for said in made.notes if said not in needless]
    return Whole(sections, [*notes, _said(name, summary_note(found))], left)


def _contact(
    explanations: Sequence[Explanation], model: NominalModel, name: str, made: Repair
) -> ContactModel | None:
    deviation = next((e for e in explanations if e.channel.value == "deviation"), None)
    if deviation is None:
        return None
    return fit_contact(
        plant_of(model, {name: made.sections}),
        name,
        deviation,
        play="backlash" in made.sections,
        free_spring=all(f.effect != SPRING for f in [*deviation.findings, *deviation.minor]),
        own_rotor=model.axes[name].motor_mass_kg > 0.0,
    )


def _said(name: str, text: str) -> str:
    return f"model.toml, axis {name}: {SPRING}: {text}"
