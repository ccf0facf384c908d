"""Identified effects as sections of a plant file, each with its parameters in hil_sim.

An effect that a plant cannot represent exactly is written as nearly as possible, or omitted; a note reports
it.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from kernels.quantities import fields_of
from reconcile.catalogue.conversion import IdentifiedTerms, NotInAPlant, PlantValues
from reconcile.catalogue.drive_compliance import CONTACT_N_M
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.catalogue.registry import CATALOGUE
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.catalogue.unnamed_terms import term
from reconcile.formats.nominal_axis import NominalAxis, baseline_parameters
from reconcile.identification.explain import Explanation
from reconcile.identification.findings import IdentifiedEffect
from reconcile.model_update.shared_values import (
    LEAST_MASS_KG,
    Sections,
    give_the_spring_masses,
    rotor,
    share_friction,
    share_mass,
    split_at_the_spring,
)
from reconcile.nominal_model.model_file import NominalModel

COARSEST_SUBSTEP_US = 50.0
ROUNDING = 1e-9
"""Difference of a value from its lower bound that needs no note."""


class AxisSections(NamedTuple):
    """The sections of one axis, and notes about them."""

    sections: Sections
    """Sections of the axis in a plant file, in its units."""
    notes: list[str]
    """Effects that could not be written as identified."""
    left_out: dict[str, str]
    """The notes about effects that no plant has, by effect."""


def axis_sections(explanations: Sequence[Explanation], model: NominalModel, name: str) -> AxisSections:
    """Return the sections for all identified effects of an axis."""
    axis, given = model.axes[name], model.document["axis"][name]
    substep_us = model.document.get("plant", {}).get("substep_us", COARSEST_SUBSTEP_US)
    sections: Sections = {}
    notes: list[str] = []
    left_out: dict[str, str] = {}
    named_by_force: set[str] = set()
    base = next((e.base for e in explanations if e.channel is ResidualChannel.FORCE), {})
    for explanation in explanations:
        is_changed = explanation.findings or explanation.minor or explanation.nominal_is_worse
        if explanation.channel is ResidualChannel.FORCE and is_changed:
            _write_base(explanation, axis, sections, notes)
        for finding in _of_all_recordings(explanation, notes):
            found = _identified(finding, explanation, base, axis)
            section = section_of_finding(finding, found)
            if section in axis.model_effects.effects:
                notes.append(f"{section} is in the model already, and is left as it was")
                continue
            if explanation.channel is not ResidualChannel.FORCE and finding.effect in named_by_force:
                notes.append(f"{section} is written as the force tells it")
                continue
            try:
                values, remarks = plant_values(finding, explanation, found)
                notes += remarks
                table = in_file_units(section, values, notes)
                sections[section] = _joined(section, sections.get(section, {}), table)
                if explanation.channel is ResidualChannel.FORCE:
                    named_by_force.add(finding.effect)
            except NotInAPlant as reason:
                notes.append(f"{finding.effect} is not in the model: {reason}")
                left_out.update(dict.fromkeys(_terms_or_name(finding), notes[-1]))
    share_friction(sections, notes)
    share_mass(sections, axis)
    if "voltage_saturation" in sections and "winding" in given:  # the amplifier of a winding has the limit
        sections["amplifier"] = {"voltage_limit_v": sections.pop("voltage_saturation")["voltage_limit_v"]}
    if "backlash" in sections and "drive_compliance" not in {*sections, *given}:
        sections["drive_compliance"] = {"stiffness_n_um": CONTACT_N_M * 1e-6}
    split_at_the_spring(explanations, sections, axis, notes)
    give_the_spring_masses(sections, axis, float(substep_us) * 1e-6, notes)
    place = f"model.toml, axis {name}: "
    by_effect = {effect: place + note for effect, note in left_out.items()}
    return AxisSections(sections, [place + note for note in notes], by_effect)


def _of_all_recordings(explanation: Explanation, notes: list[str]) -> list[IdentifiedEffect]:
    """Return the identified effects without unnamed terms of a single recording, which a note reports."""
    found = [*explanation.findings, *explanation.minor]
    kept = [f for f in found if f.effect in CATALOGUE or not any(c.per_recording for c in f.candidates)]
    if len(kept) < len(found):
        notes.append("what one recording has of its own is not in the model, which is for all of them")
    return kept


def _terms_or_name(finding: IdentifiedEffect) -> list[str]:
    """Return the identity of a finding: its name, or the terms of an unnamed one."""
    if finding.effect in CATALOGUE or not finding.candidates:
        return [finding.effect]
    return [candidate.effect for candidate in finding.candidates]


def section_of_finding(finding: IdentifiedEffect, found: IdentifiedTerms) -> str:
    """Return the section of a finding in a plant file: its name, or that of the table of an unnamed term."""
    if finding.effect in CATALOGUE:
        return CATALOGUE[finding.effect].written_as(found)
    if not finding.candidates:
        return finding.effect
    effect = finding.candidates[0].effect
    return (effect.startswith(PREFIX) and term(effect).section) or finding.effect


def _joined(section: str, before: Mapping[str, Any], table: Mapping[str, Any]) -> dict[str, Any]:
    """Join two findings of one section. Raises NotInAPlant where they have different values of a key."""
    if any(before[key] != table[key] for key in before.keys() & table.keys()):
        raise NotInAPlant(f"the plant takes one {section}, and another was found as well")
    return {**before, **table}


def _identified(
    finding: IdentifiedEffect, explanation: Explanation, base: Mapping[str, float], axis: NominalAxis
) -> IdentifiedTerms:
    channel = ResidualChannel(finding.channel)
    datasets = [residual.data for residual in explanation.residuals]
    return IdentifiedTerms(
        effect=finding.effect,
        channel=channel,
        terms=_terms_of(finding),
        datasets=datasets,
        base=base,
        axis=axis,
    )


def plant_values(
    finding: IdentifiedEffect, explanation: Explanation, found: IdentifiedTerms
) -> tuple[PlantValues, list[str]]:
    """Return the parameters of the effect by their names in hil_sim, and notes about them.

    Raises:
        NotInAPlant: there is no such effect.

    """
    if finding.effect not in CATALOGUE:
        if section_of_finding(finding, found) not in CATALOGUE:
            raise NotInAPlant("it is in no catalogue, so no plant has it")
        if found.channel is not ResidualChannel.FORCE:
            raise NotInAPlant("it is a curve of positions, and a plant has tables of forces only")
        return term(finding.candidates[0].effect).to_plant(found.terms[0]), []
    entry, residuals = CATALOGUE[finding.effect], explanation.residuals
    notes: list[str] = []
    if len(residuals) > 1 and any(candidate.per_recording for candidate in finding.candidates):
        notes.append(f"{finding.effect} has its phase as in the first recording, {residuals[0].source}")
    values, bounds = entry.to_plant(found, notes), CATALOGUE[entry.written_as(found)].bounds
    return {key: value for key, value in values.items() if key in bounds}, notes


def _terms_of(finding: IdentifiedEffect) -> list[dict[str, float]]:
    """Return the parameters of each term of a finding."""
    p = {key: estimate.value for key, estimate in finding.parameters.items()}
    count = len(finding.candidates)
    if count < 2:
        return [p]
    ends = [f"_{number}" for number in range(1, count + 1)]
    return [{key.removesuffix(end): p[key] for key in p if key.endswith(end)} for end in ends]


def in_file_units(effect: str, values: Mapping[str, Any], notes: list[str]) -> dict[str, Any]:
    """Convert SI values by parameter to the keys and units of a plant file, clipped to their bounds.

    Raises:
        NotInAPlant: a sign that the effect cannot have.

    """
    table: dict[str, Any] = {}
    for field in fields_of(CATALOGUE[effect].physics.Params):
        if field.name not in values:
            continue
        given, quantity = values[field.name], field.quantity
        if isinstance(given, str):
            table[field.key] = given
            continue
        written = []
        for value in given if isinstance(given, list) else [given]:
            within = min(max(float(value), quantity.lower), quantity.upper)
            if value < 0.0 <= quantity.lower:
                raise NotInAPlant(f"{field.name} was found to be {value:.4g}, and cannot be below 0")
            if within != value:
                notes.append(
                    f"{effect}.{field.name} was found to be {value:.4g}; {within:.4g} is what it can be"
                )
            written.append(float(quantity.from_si(within)))
        table[field.key] = written if isinstance(given, list) else written[0]
    return table


def _write_base(explanation: Explanation, axis: NominalAxis, sections: Sections, notes: list[str]) -> None:
    """Write mass and friction as fitted beside the effects, less those of the model effects.

    Where the moved mass is less than the rotor of the model, the rotor is scaled too, in proportion.
    """
    given = baseline_parameters(axis)
    elsewhere_kg, elsewhere_n = given["mass_kg"] - axis.mass_kg, given["coulomb_n"] - axis.coulomb_n
    moved_kg, motor_kg = explanation.base["mass_kg"] - elsewhere_kg, axis.motor_mass_kg
    if math.isclose(moved_kg, axis.mass_kg):
        notes.append("table.mass_kg is left as it was: the recordings do not tell the moved mass")
    if LEAST_MASS_KG < moved_kg < motor_kg + LEAST_MASS_KG:
        motor_kg = moved_kg * axis.motor_mass_kg / axis.mass_kg
        sections["motor"] = rotor(motor_kg, axis)
        notes.append(
            f"motor.inertia_kg_cm2 is less than the model says: all that moves was fitted to be "
            f"{moved_kg:.4g} kg, with the rotor"
        )
    for section, key, value, least in (
        ("table", "mass_kg", moved_kg - motor_kg, LEAST_MASS_KG),
        ("viscous_friction", "viscous_n_s_m", explanation.base["viscous_n_s_m"], 0.0),
        ("coulomb_friction", "coulomb_n", explanation.base["coulomb_n"] - elsewhere_n, 0.0),
    ):
        sections[section] = {key: max(value, least)}
        if value < least - ROUNDING:
            notes.append(
                f"{section}.{key} was fitted to be {value:.4g}; {least:g} is the least that it can be"
            )
