"""Periodic lead error: scale less motor repeats once a turn of the screw, or a few times."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from hil_sim.physics.transmission import lead_error_periodic as physics
from kernels.arrays import Array
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.entry import CatalogueEntry, IndicatorKind, Rival, UnseenTerm
from reconcile.catalogue.kinds import (
    EITHER,
    Parameter,
    RegressionData,
    ResidualChannel,
    ShapeParameters,
    TermFamily,
)
from reconcile.catalogue.periodic import amplitude_and_phase, pair, sine_and_cosine, waves

HARMONICS = (1, 2, 3, 4, 6, 8)


def _shapes(_scenes: Sequence[RegressionData]) -> list[ShapeParameters]:
    return [(float(k),) for k in HARMONICS]


def _columns(data: RegressionData, shape: ShapeParameters) -> Array:
    return pair(shape[0] * 2.0 * np.pi / data.lead_m * data.motion.position_m)


def _parameters(shape: ShapeParameters, coefficients: Array) -> dict[str, Parameter]:
    """Harmonic, amplitude and phase."""
    return {"harmonic": Parameter(shape[0], "1/turn"), **amplitude_and_phase(coefficients, "m")}


def _sentence(p: dict[str, float]) -> str:
    return (
        f"scale less motor swings by {p['amplitude'] * 1e6:.2f} um {p['harmonic']:g} times a turn: a "
        "periodic lead error, "
        "or an eccentric encoder; a third sensor would tell"
    )


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    p = of.params
    return [
        ModelTerm(
            ENTRY.name,
            (p.harmonic,),
            sine_and_cosine(p.amplitude_m, p.phase_rad),
            ResidualChannel.POSITION_DEVIATION,
        )
    ]


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(ResidualChannel.POSITION_DEVIATION, _shapes, _columns, EITHER),),
    parameters=_parameters,
    sentence=_sentence,
    additive=True,
    # told apart by a third sensor only
    equivalent=("encoder_eccentricity",),
    indicators=(
        IndicatorKind(
            name="once_a_turn_m", unit="m", words="deviation once a turn of the screw", shape=(1.0,)
        ),
    ),
    to_plant=partial(waves, pitch="harmonic", amplitude="amplitude_m"),
    from_plant=_from_plant,
    fixed_to_screw=True,
    rivals=(
        Rival(
            "encoder_eccentricity",
            "the table itself swings once a turn only if it is the screw",
            experiment="third sensor",
        ),
        Rival("backlash", "a play steps wherever the motion turns"),
        Rival(
            "scale_cyclic_error",
            "evenly over several turns each pitch repeats as often as it must",
        ),
    ),
    shown_by="it repeats once a turn at any speed",
    unseen=lambda _sizes: [UnseenTerm((1.0,), (1e-6, 0.0))],
    rank=20,
)
