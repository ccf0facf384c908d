"""Eccentric encoder: what it reads ahead the scale lags, so it is named lead_error_periodic.

A third sensor would tell them apart.
"""

from functools import partial

from hil_sim.physics.sensor import encoder_eccentricity as physics
from reconcile.catalogue import lead_error_periodic
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.entry import CatalogueEntry
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.catalogue.periodic import sine_and_cosine, waves


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    p, name = of.params, lead_error_periodic.ENTRY.name
    return [
        ModelTerm(
            name, (1.0,), sine_and_cosine(-p.amplitude_m, p.phase_rad), ResidualChannel.POSITION_DEVIATION
        )
    ]


ENTRY = CatalogueEntry(
    physics=physics,
    to_plant=partial(waves, pitch="", amplitude="amplitude_m"),
    from_plant=_from_plant,
    fixed_to_screw=True,
)
