"""A plant's step in time: one step event for each quantity that changes."""

from hil_sim.physics.load import step_in_time as physics
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.entry import CatalogueEntry
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.catalogue.step_events import IN_A_PLANT


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    return [
        ModelTerm(f"{PREFIX}moment_of_{name}", (of.params.moment_s,), (sign * getattr(of.params, key),))
        for name, (key, sign) in IN_A_PLANT.items()
        if getattr(of.params, key) != 0.0
    ]


ENTRY = CatalogueEntry(physics=physics, from_plant=_from_plant)
