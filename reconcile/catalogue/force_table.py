"""A plant's table of force over position: the smooth term over the position."""

from hil_sim.physics.load import force_table as physics
from reconcile.catalogue.entry import CatalogueEntry
from reconcile.catalogue.smooth_terms import terms_of_tables

ENTRY = CatalogueEntry(physics=physics, from_plant=terms_of_tables)
