"""Coulomb friction that differs by direction: while the axis moves it is a constant force, and named so."""

from hil_sim.physics.friction import asymmetric_coulomb_friction as physics
from reconcile.catalogue import constant_force
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.entry import CatalogueEntry, Rival
from reconcile.catalogue.kinds import ResidualChannel


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    return [ModelTerm(constant_force.ENTRY.name, (), (of.params.half_difference_n,), ResidualChannel.FORCE)]


ENTRY = CatalogueEntry(
    physics=physics,
    from_plant=_from_plant,
    rivals=(
        Rival(
            "constant_force",
            "a constant force makes the breakaway easier one way by what it makes it harder the other way",
            experiment="breakaway",
        ),
        Rival("asymmetric_viscous_friction"),
    ),
)
