"""Constant force: gravity, a counterbalance, a cable that pulls; even in the direction of motion."""

import numpy as np

from hil_sim.physics.load import constant_force as physics
from reconcile.catalogue.entry import CatalogueEntry, IndicatorKind, PlausibleTerm
from reconcile.catalogue.kinds import TermFamily

ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(lambda data, _shape: np.ones((len(data.time_s), 1))),),
    coefficients={"force_n": "N"},
    sign=-1.0,
    sentence=lambda p: (
        f"the motor pushes {abs(p['force_n']):.2f} N more in one direction than in the other, at any speed "
        "and position: a constant force, or Coulomb friction that differs by direction"
    ),
    # identical while the axis moves, and where it breaks away
    equivalent=("asymmetric_coulomb_friction",),
    mean_of="position_dependent_force",
    indicators=(IndicatorKind(name="constant_n", unit="N", words="constant force", beside=True),),
    shown_by="the breakaway differs by direction, by the same everywhere",
    plausible=lambda sizes: [PlausibleTerm((), (sizes.large_n,))],
    rank=6,
)
