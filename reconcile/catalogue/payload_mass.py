"""Payload: it shows as a fitted mass above the model's, with friction as it was, and not by a term."""

from hil_sim.physics.load import payload_mass as physics
from reconcile.catalogue.entry import CatalogueEntry

ENTRY = CatalogueEntry(physics=physics, shown_by="a known mass shows what a newton of the drive is worth")
