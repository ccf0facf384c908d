"""GMS elements of a model: an element slips 2 F / k after a reversal.

The exponential of the same area has the distance F / k.
"""

from hil_sim.physics.friction import presliding_gms as physics
from reconcile.catalogue import presliding_hysteresis
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.entry import CatalogueEntry


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    found = []
    for share, stiffness_n_m in zip(of.params.share, of.params.stiffness_n_m, strict=True):
        force_n = share * of.axis.coulomb_n
        if share == 0.0:
            break
        if force_n * stiffness_n_m > 0.0:
            shape = force_n / stiffness_n_m, 1.0
            found.append(ModelTerm(presliding_hysteresis.ENTRY.name, shape, (force_n,)))
    return found


ENTRY = CatalogueEntry(physics=physics, from_plant=_from_plant)
