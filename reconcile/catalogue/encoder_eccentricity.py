"""Eccentric encoder: what it reads ahead the scale lags, so it is named lead_error_periodic.

A third sensor would tell them apart.
"""

from hil_sim.physics.sensor import encoder_eccentricity as physics
from reconcile.catalogue import lead_error_periodic
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.entry import CatalogueEntry
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.catalogue.periodic import Wave, sine_and_cosine


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    coefficients = sine_and_cosine(-of.params.amplitude_m, of.params.phase_rad)
    name = lead_error_periodic.ENTRY.name
    return [ModelTerm(name, (1.0,), coefficients, ResidualChannel.POSITION_DEVIATION)]


ENTRY = CatalogueEntry(
    physics=physics,
    to_plant=Wave("", "", "amplitude_m", "m").to_plant,
    from_plant=_from_plant,
    fixed_to_screw=True,
)
