"""Coulomb friction that differs by direction: while the axis moves it is a constant force, and named so."""

from hil_sim.physics.friction import asymmetric_coulomb_friction as physics
from reconcile.catalogue import constant_force
from reconcile.catalogue.conversion import ModelTerm
from reconcile.catalogue.entry import CatalogueEntry, Rival

ENTRY = CatalogueEntry(
    physics=physics,
    from_plant=lambda of: [ModelTerm(constant_force.ENTRY.name, (), (of.params.half_difference_n,))],
    rivals=(
        Rival(
            "constant_force",
            "a constant force makes the breakaway easier one way by what it makes it harder the other way",
            experiment="breakaway",
        ),
        Rival("asymmetric_viscous_friction"),
    ),
)
