"""Friction that grows with the load, mu |load| in the direction of motion.

The load is what the drive transmits, inertia of the table and forces on it, without friction or with it:
gears and guides rub by one or the other. Between the two lies mu times the friction, which would go by the
names of constant force and asymmetric viscous friction under a weight.
"""

from collections.abc import Sequence

import numpy as np

from hil_sim.physics.friction import load_dependent_friction as physics
from kernels.arrays import Array
from reconcile.catalogue.entry import POSITIVE, CatalogueEntry, PlausibleTerm, Rival
from reconcile.catalogue.kinds import RegressionData, ShapeParameters, TermFamily

WITHOUT, WITH = 0.0, 1.0
"""Share of the friction that is part of the load; shares between them are too alike to be told apart."""


def _shapes(_datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    return [(WITHOUT,), (WITH,)]


def _columns(data: RegressionData, shape: ShapeParameters) -> Array:
    transmitted_n = data.model_force_n - data.motor_mass_kg * data.motion.acceleration_m_s2
    load_n = data.load_n + shape[0] * (transmitted_n - data.load_n)
    return (data.motion.direction * np.abs(load_n))[:, None]


def _sentence(p: dict[str, float]) -> str:
    friction = " with its friction" if p["friction_share"] else ""
    return (
        f"friction has {100.0 * p['load_share']:.1f} % of the force that the drive transmits{friction}, "
        "speeding up and braking alike: it grows with the load; Coulomb friction would not"
    )


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(_columns, _shapes),),
    coefficients={"load_share": ""},
    shape_parameters={"friction_share": ""},
    sentence=_sentence,
    physical=POSITIVE,
    presliding_can_imitate=True,
    rivals=(
        Rival("torque_constant_saturation", "friction turns with the motion, a lost torque with the force"),
        Rival("stribeck_friction", "at slow constant speeds without a load this friction is low"),
        Rival("payload_mass", "a mass gives back in braking what it took"),
    ),
    shown_by="friction is higher in strong accelerations, speeding up and braking",
    plausible=lambda _sizes: [PlausibleTerm((WITHOUT,), (0.1,))],
    rank=9,
)
