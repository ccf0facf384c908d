"""Coupling between axes: a force or an error that follows another axis."""

import numpy as np

from hil_sim.physics.sensor import cross_axis_coupling as physics
from kernels.arrays import Array
from reconcile.catalogue.conversion import IdentifiedTerms, ModelEffect, ModelTerm, NotInAPlant, PlantValues
from reconcile.catalogue.entry import CatalogueEntry
from reconcile.catalogue.kinds import (
    Parameter,
    RegressionData,
    ResidualChannel,
    ShapeParameters,
    TermFamily,
    no_shape,
)


def _force(data: RegressionData, _shape: ShapeParameters) -> Array:
    others = list(data.others.values())
    columns = [motion.velocity_m_s for motion in others] + [motion.acceleration_m_s2 for motion in others]
    return np.stack(columns, axis=1) if columns else np.zeros((len(data.time_s), 0))


def _deviation(data: RegressionData, _shape: ShapeParameters) -> Array:
    columns = [motion.position_m for motion in data.others.values()]
    return np.stack(columns, axis=1) if columns else np.zeros((len(data.time_s), 0))


def _parameters(_shape: ShapeParameters, coefficients: Array) -> dict[str, Parameter]:
    """One coefficient a column."""
    return {f"coefficient_{k + 1}": Parameter(float(value), "") for k, value in enumerate(coefficients)}


def _sentence(_p: dict[str, float]) -> str:
    return "the error follows the motion of another axis: the axes are coupled"


def _to_plant(found: IdentifiedTerms, notes: list[str]) -> PlantValues:
    """The axis that moves the reading most; the plant follows one."""
    if found.channel is not ResidualChannel.POSITION_DEVIATION:
        raise NotInAPlant("no force goes from axis to axis in a plant")
    others = found.datasets[0].others
    slopes = {name: found.terms[0][f"coefficient_{k}"] for k, name in enumerate(others, start=1)}
    swing_m = {name: abs(slopes[name]) * float(np.ptp(others[name].position_m)) for name in others}
    strongest = max(swing_m, key=lambda name: swing_m[name])
    notes += [
        f"{ENTRY.name}: axis {name} ({slopes[name] * 1e6:.3g} um/m) is left out, the plant takes one"
        for name in others
        if name != strongest
    ]
    return {"other": strongest, "squareness": slopes[strongest]}


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    """Nothing where the other axis was not recorded."""
    others = list(of.datasets[0].others)
    slopes = tuple(of.params.squareness if name == of.other else 0.0 for name in others)
    return [ModelTerm(ENTRY.name, (), slopes, ResidualChannel.POSITION_DEVIATION)]


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(
        TermFamily(ResidualChannel.FORCE, no_shape, _force),
        TermFamily(ResidualChannel.POSITION_DEVIATION, no_shape, _deviation),
    ),
    parameters=_parameters,
    sentence=_sentence,
    to_plant=_to_plant,
    from_plant=_from_plant,
    shown_by="it follows the other axis, even while this one stands",
    experiment="one by one",
)
