"""Cumulative lead error: scale less motor grows with the position, alike in both directions."""

from hil_sim.physics.transmission import lead_error_cumulative as physics
from kernels.arrays import Array
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.entry import CatalogueEntry, IndicatorKind, Rival, UnseenTerm
from reconcile.catalogue.kinds import (
    Parameter,
    RegressionData,
    ResidualChannel,
    ShapeParameters,
    TermFamily,
    no_shape,
)


def _columns(data: RegressionData, _shape: ShapeParameters) -> Array:
    return data.motion.position_m[:, None].copy()


def _parameters(_shape: ShapeParameters, coefficients: Array) -> dict[str, Parameter]:
    """Error per travel."""
    return {"relative_error": Parameter(float(coefficients[0]), "")}


def _sentence(p: dict[str, float]) -> str:
    return (
        f"the scale gains {p['relative_error'] * 1e6:.1f} um per metre on the motor, alike in both "
        "directions and from the "
        "first minute: a lead error; thermal expansion would drift"
    )


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    return [ModelTerm(ENTRY.name, (), (of.params.relative_error,), ResidualChannel.POSITION_DEVIATION)]


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(ResidualChannel.POSITION_DEVIATION, no_shape, _columns),),
    parameters=_parameters,
    sentence=_sentence,
    indicators=(IndicatorKind(name="lead_error", unit="", words="lead error", beside=True),),
    from_plant=_from_plant,
    rivals=(Rival("thermal_expansion", "a lead error is there from the start", experiment="warm"),),
    shown_by="it is there from the start",
    unseen=lambda _sizes: [UnseenTerm((), (2e-5,))],
    rank=19,
)
