"""A plant's structural mode as the unnamed term of ringing, with the mode's mass."""

import math

from hil_sim.physics.load import structural_mode as physics
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.entry import CatalogueEntry
from reconcile.catalogue.relaxation_terms import RINGING_EFFECT


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    """The motor carries m H a, H = w^2 / (s^2 + 2 zeta w s + w^2), less the mass that the baseline has."""
    p, zeta = of.params, min(of.params.damping_ratio, 0.99)
    # H is 2 Re(A F) of the term's complex pole F, A = w^2 / (2 i wd (zeta w - i wd))
    part = 1.0 / (2j * math.sqrt(1.0 - zeta**2) * complex(zeta, -math.sqrt(1.0 - zeta**2)))
    carried = 2.0 * p.mass_kg * part.real, -2.0 * p.mass_kg * part.imag
    return [ModelTerm(RINGING_EFFECT, (p.frequency_hz, zeta, 1.0), (*carried, -p.mass_kg))]


ENTRY = CatalogueEntry(physics=physics, from_plant=_from_plant)
