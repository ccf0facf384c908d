"""Constant force: gravity, a counterbalance, a cable that pulls; even in the direction of motion."""

import numpy as np

from hil_sim.physics.load import constant_force as physics
from kernels.arrays import Array
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.entry import CatalogueEntry, IndicatorKind, UnseenTerm
from reconcile.catalogue.kinds import (
    Parameter,
    RegressionData,
    ResidualChannel,
    ShapeParameters,
    TermFamily,
    no_shape,
)


def _columns(data: RegressionData, _shape: ShapeParameters) -> Array:
    return np.ones((len(data.time_s), 1))


def _parameters(_shape: ShapeParameters, coefficients: Array) -> dict[str, Parameter]:
    """The motor has to give c against it, so on the table it is -c."""
    return {"force_n": Parameter(-float(coefficients[0]), "N")}


def _sentence(p: dict[str, float]) -> str:
    return (
        f"the motor pushes {abs(p['force_n']):.2f} N more in one direction than in the other, at any "
        "speed and "
        "position: a constant force, or Coulomb friction that differs by direction"
    )


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    return [ModelTerm(ENTRY.name, (), (-of.params.force_n,), ResidualChannel.FORCE)]


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(ResidualChannel.FORCE, no_shape, _columns),),
    parameters=_parameters,
    sentence=_sentence,
    # identical while the axis moves, and where it breaks away
    equivalent=("asymmetric_coulomb_friction",),
    mean_of="position_dependent_force",
    indicators=(IndicatorKind(name="constant_n", unit="N", words="constant force", beside=True),),
    from_plant=_from_plant,
    shown_by="the breakaway differs by direction, by the same everywhere",
    unseen=lambda sizes: [UnseenTerm((), (sizes.large_n,))],
    rank=6,
)
