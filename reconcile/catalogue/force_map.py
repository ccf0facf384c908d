"""A plant's map of force over position and velocity: the unnamed term over both."""

from collections.abc import Sequence

from hil_sim.physics.load import force_map as physics
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.entry import CatalogueEntry
from reconcile.catalogue.map_term import MAP, terms_of_map
from reconcile.catalogue.smooth_terms import PREFIX


def _terms(of: ModelEffect) -> Sequence[ModelTerm]:
    return terms_of_map(of, PREFIX + MAP)


ENTRY = CatalogueEntry(physics=physics, from_plant=_terms)
