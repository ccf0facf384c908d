"""A plant's change of damping and mass along the travel: the smooth terms of these over the position."""

from hil_sim.physics.load import change_along_travel as physics
from reconcile.catalogue.entry import CatalogueEntry
from reconcile.catalogue.smooth_terms import terms_of_tables

ENTRY = CatalogueEntry(physics=physics, from_plant=terms_of_tables)
