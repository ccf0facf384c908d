"""Coupling between axes: a force or an error that follows another axis."""

from collections.abc import Sequence

import numpy as np

from hil_sim.physics.sensor import cross_axis_coupling as physics
from kernels.arrays import Array
from reconcile.catalogue.conversion import IdentifiedTerms, ModelEffect, ModelTerm, NotInAPlant, PlantValues
from reconcile.catalogue.entry import CatalogueEntry
from reconcile.catalogue.kinds import (
    RegressionData,
    ResidualChannel,
    ShapeParameters,
    SiParameter,
    TermFamily,
)


def _force(data: RegressionData, _shape: ShapeParameters) -> Array:
    others = data.others.values()
    return _stacked(data, [m.velocity_m_s for m in others] + [m.acceleration_m_s2 for m in others])


def _stacked(data: RegressionData, columns: Sequence[Array]) -> Array:
    return np.stack(columns, axis=1) if columns else np.zeros((len(data.time_s), 0))


def _parameters(_shape: ShapeParameters, coefficients: Array) -> dict[str, SiParameter]:
    """One coefficient a column."""
    return {f"coefficient_{k + 1}": SiParameter(float(value), "") for k, value in enumerate(coefficients)}


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
    return [ModelTerm(of.effect, (), slopes, ResidualChannel.POSITION_DEVIATION)]


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(
        TermFamily(_force),
        TermFamily(
            lambda data, _shape: _stacked(data, [m.position_m for m in data.others.values()]),
            channel=ResidualChannel.POSITION_DEVIATION,
        ),
    ),
    parameters_of=_parameters,
    sentence=lambda _parameters: "the error follows the motion of another axis: the axes are coupled",
    to_plant=_to_plant,
    from_plant=_from_plant,
    shown_by="it follows the other axis, even while this one stands",
    experiment="one by one",
)
