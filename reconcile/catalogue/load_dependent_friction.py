"""Friction that grows with the transmitted load, mu |Fl| in the direction of motion.

The load is the fitted model's force without friction: inertia, weight and what else the motor has to bear.
"""

import numpy as np

from hil_sim.physics.friction import load_dependent_friction as physics
from kernels.arrays import Array
from reconcile.catalogue.entry import POSITIVE, CatalogueEntry, PlausibleTerm, Rival
from reconcile.catalogue.kinds import RegressionData, ShapeParameters, TermFamily


def _columns(data: RegressionData, _shape: ShapeParameters) -> Array:
    load_n = np.abs(data.load_n) * np.ones(len(data.time_s))
    column: Array = (data.motion.direction * load_n)[:, None]
    return column


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(_columns),),
    coefficients={"load_share": ""},
    sentence=lambda p: (
        f"friction has {100.0 * p['load_share']:.1f} % of the force that the drive transmits, speeding "
        "up and braking alike: it grows with the load; Coulomb friction would not"
    ),
    physical=POSITIVE,
    presliding_can_imitate=True,
    rivals=(
        Rival("torque_constant_saturation", "friction turns with the motion, a lost torque with the force"),
        Rival("stribeck_friction", "at slow constant speeds without a load this friction is low"),
        Rival("payload_mass", "a mass gives back in braking what it took"),
    ),
    shown_by="friction is higher in strong accelerations, speeding up and braking",
    plausible=lambda _sizes: [PlausibleTerm((), (0.1,))],
    rank=9,
)
