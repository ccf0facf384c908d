"""A plant's table of friction over position: the smooth term over position and direction."""

from hil_sim.physics.friction import friction_table as physics
from reconcile.catalogue.entry import CatalogueEntry
from reconcile.catalogue.smooth_terms import terms_of_tables

ENTRY = CatalogueEntry(physics=physics, from_plant=terms_of_tables)
