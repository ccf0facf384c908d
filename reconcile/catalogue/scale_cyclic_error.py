"""Cyclic error of the scale: e sin(2 pi x / p), p the grating period."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from hil_sim.physics.sensor import scale_cyclic_error as physics
from kernels.arrays import Array
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.entry import CatalogueEntry, Rival, UnseenTerm
from reconcile.catalogue.kinds import (
    OWN,
    Parameter,
    RegressionData,
    ResidualChannel,
    ShapeParameters,
    TermFamily,
)
from reconcile.catalogue.periodic import amplitude_and_phase, pair, sine_and_cosine, waves

PERIODS_M = (2e-6, 4e-6, 8e-6, 1e-5, 2e-5, 4e-5, 1e-4, 2e-4, 5e-4, 1e-3)


def _shapes(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    return [(period,) for period in PERIODS_M if period < 0.5 * datasets[0].lead_m]


def _columns(data: RegressionData, shape: ShapeParameters) -> Array:
    return pair(2.0 * np.pi / shape[0] * data.motion.position_m)


def _parameters(shape: ShapeParameters, coefficients: Array) -> dict[str, Parameter]:
    """Period, amplitude, and the phase in the first recording."""
    return {"period_m": Parameter(shape[0], "m"), **amplitude_and_phase(coefficients, "m")}


def _sentence(p: dict[str, float]) -> str:
    return (
        f"the scale swings by {p['amplitude'] * 1e6:.2f} um every {p['period_m'] * 1e6:.1f} um: a cyclic "
        "error within its "
        "grating period; in the force it grows with the square of the speed"
    )


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    p = of.params
    return [
        ModelTerm(
            ENTRY.name,
            (p.period_m,),
            sine_and_cosine(p.amplitude_m, p.phase_rad),
            ResidualChannel.POSITION_DEVIATION,
        )
    ]


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(ResidualChannel.POSITION_DEVIATION, _shapes, _columns, OWN),),
    parameters=_parameters,
    sentence=_sentence,
    additive=True,
    to_plant=partial(waves, pitch="period_m", amplitude="amplitude_m"),
    from_plant=_from_plant,
    rivals=(Rival("lead_error_periodic"), Rival("cogging")),
    shown_by="in the force it grows with the square of the speed",
    unseen=lambda _sizes: [UnseenTerm((2e-5,), (1e-7, 0.0))],
    rank=21,
)
