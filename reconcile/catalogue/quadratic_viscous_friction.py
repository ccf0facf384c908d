"""Quadratic viscous friction, F2 v |v|; F2 is negative where friction grows slower than the speed."""

import numpy as np

from hil_sim.physics.friction import quadratic_viscous_friction as physics
from kernels.arrays import Array
from reconcile.catalogue.entry import CatalogueEntry, PlausibleTerm, Rival
from reconcile.catalogue.kinds import RegressionData, ShapeParameters, TermFamily

BY_CONSTANT_SPEED = "at constant speed the force is small: what grows with the speed is friction"


def _columns(data: RegressionData, _shape: ShapeParameters) -> Array:
    v = data.motion.velocity_m_s
    return (v * np.abs(v))[:, None]


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(_columns),),
    coefficients={"quadratic_n_s2_m2": "N s^2/m^2"},
    sentence=lambda p: (
        f"friction bends over speed, by {p['quadratic_n_s2_m2']:.1f} N s^2/m^2 v |v| in both directions alike"
    ),
    rivals=(
        Rival("stribeck_friction"),
        Rival("torque_constant_saturation", BY_CONSTANT_SPEED),
        Rival("voltage_saturation", BY_CONSTANT_SPEED),
    ),
    shown_by="friction grows with the square of the speed",
    plausible=lambda sizes: [PlausibleTerm((), (sizes.large_n / sizes.fastest_m_s**2,))],
    rank=5,
)
