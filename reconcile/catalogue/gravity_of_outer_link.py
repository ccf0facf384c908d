"""Gravity of an outer link, whose angle is the sum of two joints: a sin(q + k qo) + b cos(q + k qo)."""

from collections.abc import Sequence

from hil_sim.physics.load import gravity_of_outer_link as physics
from kernels.arrays import Array
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.entry import CatalogueEntry, Rival
from reconcile.catalogue.kinds import RegressionData, ShapeParameters, SiParameter, TermFamily
from reconcile.catalogue.other_joints import moved_joints, name_of_joint, number_of_joint, with_name_of_joint
from reconcile.catalogue.periodic import amplitude_and_phase_rad, pair, sine_and_cosine


def _shapes(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    """Number of the other joint, and its sense."""
    return [(number, sense) for number in moved_joints(datasets) for sense in (1.0, -1.0)]


def _columns(data: RegressionData, shape: ShapeParameters) -> Array:
    other = data.others[name_of_joint(data, shape[0])]
    return pair(data.motion.position_m + shape[1] * other.position_m)


def _parameters(shape: ShapeParameters, coefficients: Array) -> dict[str, SiParameter]:
    """The force on the table is the opposite of what the motor needs."""
    amplitude_n, phase_rad = amplitude_and_phase_rad(*(-coefficients[:2]).tolist())
    return {
        "other": SiParameter(shape[0], ""),
        "amplitude_n": SiParameter(amplitude_n, "N"),
        "phase_rad": SiParameter(phase_rad, "rad"),
        "sense": SiParameter(shape[1], ""),
    }


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    """Nothing where the other joint was not recorded."""
    p, number = of.params, number_of_joint(of)
    if number is None or p.amplitude_n == 0.0:
        return []
    return [ModelTerm(of.effect, (number, p.sense), sine_and_cosine(-p.amplitude_n, p.phase_rad))]


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(_columns, _shapes),),
    parameters_of=_parameters,
    sentence=lambda p: (
        f"a moment of {p['amplitude_n']:.3g} follows the sine of the sum of this angle and another joint's: "
        "the weight of a link that both joints turn"
    ),
    to_plant=with_name_of_joint,
    from_plant=_from_plant,
    rivals=(Rival("gravity", "the weight of this link alone does not change while the other joint turns"),),
    shown_by="the force follows the angle of the other joint while this one stands",
    experiment="one by one",
    rank=8,
)
