"""A plant's relaxation: the unnamed term of that name."""

from hil_sim.physics.load import relaxation as physics
from reconcile.catalogue.conversion import ModelTerm
from reconcile.catalogue.entry import CatalogueEntry
from reconcile.catalogue.smooth_terms import PREFIX

ENTRY = CatalogueEntry(
    physics=physics,
    from_plant=lambda of: [ModelTerm(f"{PREFIX}relaxation", (of.params.time_s,), (of.params.damping_n_s_m,))],
)
