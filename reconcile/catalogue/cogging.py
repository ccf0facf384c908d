"""Cogging: a force fixed in space, sum A_k sin(k 2 pi x / lead + p_k), whatever the current and the speed."""

from collections.abc import Sequence

import numpy as np

from hil_sim.physics.motor import cogging as physics
from reconcile.catalogue.entry import CatalogueEntry, IndicatorKind, PlausibleTerm, Rival
from reconcile.catalogue.kinds import EITHER, RegressionData, ShapeParameters, TermFamily
from reconcile.catalogue.periodic import RIPPLES_A_TURN, Wave, covered, harmonics_of_the_joint, over_turns

HARMONICS = (*range(1, 13), 14, 16, 18, 20, 24, 28, 30, 36, 42, 48, 60, 72, 84, 96)
WAVE = Wave("harmonic", "1/turn", "amplitude_n", "N", most=physics.HARMONICS_MAX)


def _shapes(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    # do not scan a ripple that the filter attenuates at the speeds of the recordings
    speeds_m_s = np.abs(np.concatenate([data.motion.velocity_m_s for data in datasets]))
    highest = datasets[0].lead_m * 60.0 / max(float(np.percentile(speeds_m_s, 60)), 1e-6)
    of_the_motor = [k for k in HARMONICS if k <= max(highest, 12.0)]
    return covered(datasets, [*of_the_motor, *harmonics_of_the_joint(datasets)])


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(over_turns, _shapes, per_recording=EITHER),),
    parameters_of=WAVE.parameters,
    sentence=lambda p: (
        f"a force of {p['amplitude']:.2f} N comes back at the same places, {p['harmonic']:g} a turn, "
        "whatever the speed and the current: cogging; a torque ripple would grow with the current"
    ),
    additive=True,
    on_every_axis=True,
    indicators=(IndicatorKind("once_a_turn_n", "N", "force once a turn of the screw", (1.0,)),),
    to_plant=WAVE.to_plant,
    from_plant=WAVE.from_plant,
    fixed_to_screw=True,
    rivals=(
        Rival(
            "torque_ripple", "over the same places a torque ripple grows with the current, cogging does not"
        ),
        Rival(
            "periodic_disturbance",
            "cogging changes its frequency with the speed, a disturbance from outside does not",
        ),
        Rival(
            "scale_cyclic_error", "the force that a scale's error causes grows with the square of the speed"
        ),
        Rival("position_dependent_force", "over several turns cogging repeats"),
        Rival(
            "position_dependent_friction",
            "over the same places both ways, cogging keeps its sign and friction does not",
        ),
    ),
    shown_by="it stays at its places at any speed",
    plausible=lambda sizes: [PlausibleTerm((RIPPLES_A_TURN,), (sizes.small_n, 0.0))],
    rank=10,
)
