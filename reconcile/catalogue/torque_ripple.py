"""Torque ripple: the motor force times a periodic factor, 1 + sum e_k sin(k 2 pi x / lead + p_k)."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from hil_sim.physics.motor import torque_ripple as physics
from kernels.arrays import Array
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.entry import CatalogueEntry, Rival, UnseenTerm
from reconcile.catalogue.kinds import (
    EITHER,
    Parameter,
    RegressionData,
    ResidualChannel,
    ShapeParameters,
    TermFamily,
)
from reconcile.catalogue.periodic import RIPPLES_A_TURN, amplitude_and_phase, force_harmonics, pair, waves

HARMONICS = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 18, 20, 24, 30, 36, 42, 48)


def _shapes(_scenes: Sequence[RegressionData]) -> list[ShapeParameters]:
    return [(float(k),) for k in HARMONICS]


def _columns(data: RegressionData, shape: ShapeParameters) -> Array:
    angle_rad = shape[0] * 2.0 * np.pi / data.lead_m * data.motion.position_m
    return data.model_force_n[:, None] * pair(angle_rad)


def _parameters(shape: ShapeParameters, coefficients: Array) -> dict[str, Parameter]:
    """Harmonic, relative amplitude and phase of the torque constant."""
    return {"harmonic": Parameter(shape[0], "1/turn"), **amplitude_and_phase(-coefficients, "")}


def _sentence(p: dict[str, float]) -> str:
    return (
        f"the force varies by {100.0 * p['amplitude']:.1f} % of itself {p['harmonic']:g} times a turn: "
        "torque ripple; "
        "cogging would be there without current too"
    )


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    p = of.params
    return force_harmonics(ENTRY.name, p.harmonic, p.amplitude, p.phase_rad)


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(ResidualChannel.FORCE, _shapes, _columns, EITHER),),
    parameters=_parameters,
    sentence=_sentence,
    additive=True,
    to_plant=partial(waves, pitch="harmonic", amplitude="amplitude", most=physics.TERMS),
    from_plant=_from_plant,
    fixed_to_screw=True,
    rivals=(
        Rival("presliding_hysteresis"),
        Rival("cogging"),
        Rival(
            "periodic_disturbance",
            "a ripple changes its frequency with the speed, a disturbance from outside does not",
        ),
    ),
    shown_by="it grows with the current",
    unseen=lambda _sizes: [UnseenTerm((RIPPLES_A_TURN,), (0.03, 0.0))],
    rank=11,
)
