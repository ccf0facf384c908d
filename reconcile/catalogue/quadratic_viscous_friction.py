"""Quadratic viscous friction, F2 v |v|."""

import numpy as np

from hil_sim.physics.friction import quadratic_viscous_friction as physics
from kernels.arrays import Array
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.entry import CatalogueEntry, Rival, UnseenTerm
from reconcile.catalogue.kinds import (
    Parameter,
    RegressionData,
    ResidualChannel,
    ShapeParameters,
    TermFamily,
    no_shape,
)


def _columns(data: RegressionData, _shape: ShapeParameters) -> Array:
    v = data.motion.velocity_m_s
    return (v * np.abs(v))[:, None]


def _parameters(_shape: ShapeParameters, coefficients: Array) -> dict[str, Parameter]:
    """F2; negative where friction grows slower than the speed."""
    return {"quadratic_n_s2_m2": Parameter(float(coefficients[0]), "N s^2/m^2")}


def _sentence(p: dict[str, float]) -> str:
    return (
        f"friction bends over speed, by {p['quadratic_n_s2_m2']:.1f} N s^2/m^2 v |v| in both directions alike"
    )


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    return [ModelTerm(ENTRY.name, (), (of.params.quadratic_n_s2_m2,), ResidualChannel.FORCE)]


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(ResidualChannel.FORCE, no_shape, _columns),),
    parameters=_parameters,
    sentence=_sentence,
    from_plant=_from_plant,
    rivals=(
        Rival("stribeck_friction"),
        Rival(
            "torque_constant_saturation",
            "at constant speed the force is small: what grows with the speed is friction",
        ),
        Rival(
            "voltage_saturation",
            "at constant speed the force is small: what grows with the speed is friction",
        ),
    ),
    shown_by="friction grows with the square of the speed",
    unseen=lambda sizes: [UnseenTerm((), (sizes.large_n / sizes.fastest_m_s**2,))],
    rank=5,
)
