"""Cogging: a force fixed in space, sum A_k sin(k 2 pi x / lead + p_k), whatever the current and the speed."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from hil_sim.physics.motor import cogging as physics
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
from reconcile.catalogue.periodic import RIPPLES_A_TURN, amplitude_and_phase, force_harmonics, pair, waves

HARMONICS = (*range(1, 13), 14, 16, 18, 20, 24, 28, 30, 36, 42, 48, 60, 72, 84, 96)


def _shapes(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    # do not scan a ripple that the filter attenuates at the speeds of the recordings
    speeds_m_s = np.abs(np.concatenate([data.motion.velocity_m_s for data in datasets]))
    highest = datasets[0].lead_m * 60.0 / max(float(np.percentile(speeds_m_s, 60)), 1e-6)
    return [(float(k),) for k in HARMONICS if k <= max(highest, 12.0)]


def _columns(data: RegressionData, shape: ShapeParameters) -> Array:
    return pair(shape[0] * 2.0 * np.pi / data.lead_m * data.motion.position_m)


def _parameters(shape: ShapeParameters, coefficients: Array) -> dict[str, Parameter]:
    """Harmonic, amplitude and phase of the force on the motor."""
    return {"harmonic": Parameter(shape[0], "1/turn"), **amplitude_and_phase(-coefficients, "N")}


def _sentence(p: dict[str, float]) -> str:
    return (
        f"a force of {p['amplitude']:.2f} N comes back at the same places, {p['harmonic']:g} a turn, "
        "whatever the "
        "speed and the current: cogging; a torque ripple would grow with the current"
    )


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    p = of.params
    return force_harmonics(ENTRY.name, p.harmonic, p.amplitude_n, p.phase_rad)


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(ResidualChannel.FORCE, _shapes, _columns, EITHER),),
    parameters=_parameters,
    sentence=_sentence,
    additive=True,
    on_every_axis=True,
    indicators=(
        IndicatorKind(name="once_a_turn_n", unit="N", words="force once a turn of the screw", shape=(1.0,)),
    ),
    to_plant=partial(waves, pitch="harmonic", amplitude="amplitude_n", most=physics.TERMS),
    from_plant=_from_plant,
    fixed_to_screw=True,
    rivals=(
        Rival(
            "torque_ripple",
            "over the same places a torque ripple grows with the current, cogging does not",
        ),
        Rival(
            "periodic_disturbance",
            "cogging changes its frequency with the speed, a disturbance from outside does not",
        ),
        Rival(
            "scale_cyclic_error",
            "the force that a scale's error causes grows with the square of the speed",
        ),
        Rival("position_dependent_force", "over several turns cogging repeats"),
        Rival(
            "position_dependent_friction",
            "over the same places both ways, cogging keeps its sign and friction does not",
        ),
    ),
    shown_by="it stays at its places at any speed",
    unseen=lambda sizes: [UnseenTerm((RIPPLES_A_TURN,), (sizes.small_n, 0.0))],
    rank=10,
)
