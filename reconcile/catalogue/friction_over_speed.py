"""A plant's table of friction over speed: the smooth term over the speed's logarithm."""

from hil_sim.physics.friction import friction_over_speed as physics
from reconcile.catalogue.entry import CatalogueEntry
from reconcile.catalogue.smooth_terms import terms_of_tables

ENTRY = CatalogueEntry(physics=physics, from_plant=terms_of_tables)
