"""A plant's presliding elements: each is a term of presliding, at its distance and exponent."""

from hil_sim.physics.friction import presliding_elements as physics
from reconcile.catalogue import presliding_hysteresis
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.entry import CatalogueEntry


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    p, found = of.params, []
    for share, way_m, exponent in zip(p.share, p.way_m, p.exponent, strict=True):
        if share == 0.0:
            break
        level_n = share * p.level_n
        found.append(ModelTerm(presliding_hysteresis.ENTRY.name, (way_m, exponent), (level_n,)))
    return found


ENTRY = CatalogueEntry(physics=physics, from_plant=_from_plant)
