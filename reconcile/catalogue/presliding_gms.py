"""GMS elements of a model: springs that slip at their share of the level, without their frictional lag.

When identified they are elements of presliding_hysteresis with the exponent 0, which a plant holds as
presliding_elements: beside the other levels, and not shaping them.
"""

import math

from hil_sim.physics.friction import presliding_gms as physics
from reconcile.catalogue import presliding_hysteresis
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.entry import CatalogueEntry

SLIPPED_SHARE = -math.expm1(-1.0)
"""Of a spring's distance, within which 63 % build up."""


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    found = []
    for share, stiffness_n_m in zip(of.params.share, of.params.stiffness_n_m, strict=True):
        force_n = share * of.axis.coulomb_n
        if share == 0.0:
            break
        if force_n * stiffness_n_m > 0.0:
            shape = SLIPPED_SHARE * force_n / stiffness_n_m, 0.0
            found.append(ModelTerm(presliding_hysteresis.ENTRY.name, shape, (force_n,)))
    return found


ENTRY = CatalogueEntry(physics=physics, from_plant=_from_plant)
