"""Amplifier dead zone: the amplifier makes no force below a threshold of the command."""

from collections.abc import Sequence

import numpy as np

from hil_sim.physics.motor import amplifier_dead_zone as physics
from kernels.arrays import Array
from reconcile.catalogue.conversion import IdentifiedTerms, ModelEffect, ModelTerm, PlantValues
from reconcile.catalogue.entry import CatalogueEntry, Rival, UnseenTerm
from reconcile.catalogue.kinds import Parameter, RegressionData, ResidualChannel, ShapeParameters, TermFamily

SHARES = (0.5, 1.0, 2.0, 4.0)


def _shapes(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    typical_n = float(np.median(np.abs(np.concatenate([data.model_force_n for data in datasets]))))
    return [(share * 0.25 * typical_n,) for share in SHARES if typical_n > 0.0]


def _columns(data: RegressionData, shape: ShapeParameters) -> Array:
    return np.clip(data.model_force_n / shape[0], -1.0, 1.0)[:, None]


def _possible(coefficients: Array) -> bool:
    """A dead zone loses force."""
    return bool(coefficients[0] > 0.0)


def _parameters(shape: ShapeParameters, coefficients: Array) -> dict[str, Parameter]:
    """The force lost beyond the threshold, and the width of the transition, N."""
    return {"threshold_n": Parameter(float(coefficients[0]), "N"), "width_n": Parameter(shape[0], "N")}


def _sentence(p: dict[str, float]) -> str:
    return (
        f"about {p['threshold_n']:.2f} N of the commanded force are lost whenever its sign is clear, "
        "changing over at "
        "zero force and not at zero speed: a dead zone of the amplifier"
    )


def _to_plant(found: IdentifiedTerms, _notes: list[str]) -> PlantValues:
    return {"threshold_a": found.terms[0]["threshold_n"] / found.axis.force_constant_n_a}


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    """The narrowest width that is scanned: the plant's dead zone steps and has no width."""
    lost_n = of.params.threshold_a * of.axis.force_constant_n_a
    return [
        ModelTerm(ENTRY.name, min(_shapes(of.datasets), default=(lost_n,)), (lost_n,), ResidualChannel.FORCE)
    ]


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(ResidualChannel.FORCE, _shapes, _columns),),
    parameters=_parameters,
    sentence=_sentence,
    possible=_possible,
    continuous_shape_numbers=1,
    presliding_can_imitate=True,
    shows_after_presliding=True,
    to_plant=_to_plant,
    from_plant=_from_plant,
    rivals=(
        Rival(
            "asymmetric_coulomb_friction",
            "a dead zone shows where the force is zero, friction where the speed is",
        ),
        Rival("stribeck_friction", "a dead zone shows where the force is zero, friction where the speed is"),
        Rival(
            "presliding_hysteresis",
            "a dead zone shows where the force is zero, presliding where the motion turns",
        ),
    ),
    shown_by="it shows where the force is zero",
    unseen=lambda sizes: [UnseenTerm((0.25 * sizes.coulomb_n,), (sizes.small_n,))],
    rank=15,
)
