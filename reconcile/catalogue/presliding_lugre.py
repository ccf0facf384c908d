"""LuGre's bristle of a model: at a constant level it is Dahl's, of all the sharp friction.

Its damping is left out.
"""

from hil_sim.physics.friction import presliding_lugre as physics
from reconcile.catalogue import presliding_hysteresis
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.entry import CatalogueEntry


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    level_n = of.axis.coulomb_n
    shape = level_n / of.params.stiffness_n_m, 1.0
    return [ModelTerm(presliding_hysteresis.ENTRY.name, shape, (level_n,))] if level_n > 0.0 else []


ENTRY = CatalogueEntry(physics=physics, from_plant=_from_plant)
