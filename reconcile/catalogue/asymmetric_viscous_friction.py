"""Viscous friction that differs by direction, Fv+ against Fv-: half the difference of the two slopes."""

import numpy as np

from hil_sim.physics.friction import asymmetric_viscous_friction as physics
from reconcile.catalogue.entry import CatalogueEntry, PlausibleTerm, Rival
from reconcile.catalogue.kinds import TermFamily

BY_SPEED = "the difference between the directions grows with the speed only if it is viscous"


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(lambda data, _shape: np.abs(data.motion.velocity_m_s)[:, None]),),
    coefficients={"half_difference_n_s_m": "N s/m"},
    sentence=lambda p: (
        f"friction grows with speed by {2.0 * abs(p['half_difference_n_s_m']):.1f} N s/m more in one "
        "direction than in the other: viscous friction that differs by direction; a constant force "
        "would not grow"
    ),
    rivals=(Rival("asymmetric_coulomb_friction", BY_SPEED), Rival("constant_force", BY_SPEED)),
    shown_by="the directions differ more at higher speed",
    plausible=lambda sizes: [PlausibleTerm((), (sizes.large_n / sizes.fastest_m_s,))],
    rank=4,
)
