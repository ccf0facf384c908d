"""Inertial coupling of two joints: the force that the motion of another joint needs at this one.

With J of the outer link, h and p of `hil_sim.physics.load.joint_coupling`, the motor must give

    J ao + h cos(p) (cos(q) A - sin(q) B) - h sin(p) (sin(q) A + cos(q) B)

q is the position of the outer joint, ao the acceleration of the other joint. At the outer joint A = ao and
B = -vo^2, at the inner A = ao + 2 a and B = (2 v + vo) vo.
"""

import math
from collections.abc import Sequence

import numpy as np

from hil_sim.physics.load import joint_coupling as physics
from kernels.arrays import Array
from reconcile.catalogue.conversion import IdentifiedTerms, ModelEffect, ModelTerm
from reconcile.catalogue.entry import CatalogueEntry
from reconcile.catalogue.kinds import RegressionData, ShapeParameters, SiParameter, TermFamily
from reconcile.catalogue.other_joints import moved_joints, name_of_joint, number_of_joint, with_name_of_joint
from reconcile.catalogue.periodic import amplitude_and_phase_rad, sine_and_cosine
from reconcile.recording.kinematics import kinematics

INNER, OUTER = 0.0, 1.0
PLACES = (OUTER, INNER)
"""Of this joint in the chain, as the plant's parameter `outer` has them."""
LARGEST_RATIO = 1.1
"""Largest inertia of the outer link over what the joint was fitted to move; chosen: scatter of the fits."""
Derivatives = tuple[Array, Array, Array]
"""Position (rad), velocity (rad/s) and acceleration (rad/s^2) of a joint, (n,) each."""


def _shapes(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    """Number of the other joint, and whether this one is the outer."""
    return [(number, place) for number in moved_joints(datasets) for place in PLACES]


def coupled(own: Derivatives, other: Derivatives, place: float) -> Array:
    """Force (n, 3) that the motion of another joint needs at this one, for J, h cos(p) and h sin(p) of 1."""
    q, _, own_acceleration = own
    _, speed, acceleration = other
    along, across = acceleration, -(speed**2)
    if place == INNER:
        q, along, across = other[0], acceleration + 2.0 * own_acceleration, (2.0 * own[1] + speed) * speed
    cosine, sine = np.cos(q), np.sin(q)
    columns = (acceleration, cosine * along - sine * across, -(sine * along + cosine * across))
    return np.stack(columns, axis=1)


def _columns(data: RegressionData, shape: ShapeParameters) -> Array:
    """Forces of joints may cancel, as of one that swings freely, if each is filtered as often as the torque.

    So this joint has the wide low pass of the other, not the one that all columns get.
    """
    other = data.others[name_of_joint(data, shape[0])]
    own = kinematics(data.motion.position_m, data.period_s, other.corner_hz)
    of_own, of_other = ((of.position_m, of.velocity_m_s, of.acceleration_m_s2) for of in (own, other))
    return coupled(of_own, of_other, shape[1])


def _parameters(shape: ShapeParameters, coefficients: Array) -> dict[str, SiParameter]:
    inertia, *turning = coefficients.tolist()
    arm, phase_rad = amplitude_and_phase_rad(*turning)
    return {
        "other": SiParameter(shape[0], ""),
        "outer": SiParameter(shape[1], ""),
        "inertia_kg": SiParameter(inertia, "kg"),
        "arm_kg": SiParameter(arm, "kg"),
        "phase_rad": SiParameter(phase_rad, "rad"),
    }


def _refused(found: IdentifiedTerms) -> str:
    inertia_kg, moved_kg = found.terms[0]["inertia_kg"], found.base.get("mass_kg", math.inf)
    if 0.0 < inertia_kg <= LARGEST_RATIO * moved_kg:
        return ""
    return (
        f"the inertia of the outer link would be {inertia_kg:.3g}, and is above 0 and at most what either "
        f"joint moves, {moved_kg:.3g}"
    )


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    """Nothing where the other joint was not recorded."""
    p, number = of.params, number_of_joint(of)
    if number is None:
        return []
    turning = sine_and_cosine(p.arm_kg, p.phase_rad)
    return [ModelTerm(of.effect, (number, p.outer), (p.inertia_kg, *turning))]


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(_columns, _shapes),),
    parameters_of=_parameters,
    sentence=lambda p: (
        f"the motion of another joint moves this one: a link couples them by {p['inertia_kg']:.3g}, and by "
        f"{p['arm_kg']:.3g} that turns with the outer joint"
    ),
    to_plant=with_name_of_joint,
    from_plant=_from_plant,
    refused=_refused,
    shown_by="it follows the acceleration of the other joint, even while this one stands",
    experiment="one by one",
    rank=8,
)
