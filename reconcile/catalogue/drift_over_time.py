"""A plant's drift of force, friction, damping and mass: the smooth terms over the run time."""

from hil_sim.physics.load import drift_over_time as physics
from reconcile.catalogue.entry import CatalogueEntry
from reconcile.catalogue.smooth_terms import terms_of_tables

ENTRY = CatalogueEntry(physics=physics, from_plant=terms_of_tables)
