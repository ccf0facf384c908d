"""A plant's disturbance of a given spectrum, as lines of known phase."""

from hil_sim.physics.load import disturbance_spectrum as physics
from reconcile.catalogue import periodic_disturbance
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.entry import CatalogueEntry
from reconcile.catalogue.periodic import sine_and_cosine


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    found = []
    for line, (frequency_hz, amplitude_n) in enumerate(
        zip(of.params.frequency_hz, of.params.amplitude_n, strict=True)
    ):
        if amplitude_n == 0.0:
            break
        coefficients = sine_and_cosine(-amplitude_n, physics.phase_rad(of.params.seed, line))
        found.append(ModelTerm(periodic_disturbance.ENTRY.name, (frequency_hz,), coefficients))
    return found


ENTRY = CatalogueEntry(physics=physics, from_plant=_from_plant)
