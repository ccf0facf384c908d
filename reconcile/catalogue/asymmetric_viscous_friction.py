"""Viscous friction that differs by direction, Fv+ against Fv-."""

import numpy as np

from hil_sim.physics.friction import asymmetric_viscous_friction as physics
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
    return np.abs(data.motion.velocity_m_s)[:, None]


def _parameters(_shape: ShapeParameters, coefficients: Array) -> dict[str, Parameter]:
    """Half the difference of the two slopes."""
    return {"half_difference_n_s_m": Parameter(float(coefficients[0]), "N s/m")}


def _sentence(p: dict[str, float]) -> str:
    return (
        f"friction grows with speed by {2.0 * abs(p['half_difference_n_s_m']):.1f} N s/m more in one "
        "direction than "
        "in the other: viscous friction that differs by direction; a constant force would not grow"
    )


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    return [ModelTerm(ENTRY.name, (), (of.params.half_difference_n_s_m,), ResidualChannel.FORCE)]


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(ResidualChannel.FORCE, no_shape, _columns),),
    parameters=_parameters,
    sentence=_sentence,
    from_plant=_from_plant,
    rivals=(
        Rival(
            "asymmetric_coulomb_friction",
            "the difference between the directions grows with the speed only if it is viscous",
        ),
        Rival(
            "constant_force",
            "the difference between the directions grows with the speed only if it is viscous",
        ),
    ),
    shown_by="the directions differ more at higher speed",
    unseen=lambda sizes: [UnseenTerm((), (sizes.large_n / sizes.fastest_m_s,))],
    rank=4,
)
