"""Torque ripple: the motor force times a periodic factor, 1 + sum e_k sin(k 2 pi x / lead + p_k)."""

from collections.abc import Sequence

from hil_sim.physics.motor import torque_ripple as physics
from reconcile.catalogue.entry import CatalogueEntry, PlausibleTerm, Rival
from reconcile.catalogue.kinds import EITHER, RegressionData, ShapeParameters, TermFamily
from reconcile.catalogue.periodic import RIPPLES_A_TURN, Wave, covered, harmonics_of_the_joint, over_turns

HARMONICS = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 18, 20, 24, 30, 36, 42, 48)
WAVE = Wave("harmonic", "1/turn", "amplitude", "", most=physics.HARMONICS_MAX)
"""Its amplitude is a share of the force."""


def _shapes(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    return covered(datasets, [*HARMONICS, *harmonics_of_the_joint(datasets)])


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(
        TermFamily(
            lambda data, shape: data.model_force_n[:, None] * over_turns(data, shape),
            _shapes,
            per_recording=EITHER,
        ),
    ),
    parameters_of=WAVE.parameters,
    sentence=lambda p: (
        f"the force varies by {100.0 * p['amplitude']:.1f} % of itself {p['harmonic']:g} times a turn: "
        "torque ripple; cogging would be there without current too"
    ),
    additive=True,
    to_plant=WAVE.to_plant,
    from_plant=WAVE.from_plant,
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
    plausible=lambda _sizes: [PlausibleTerm((RIPPLES_A_TURN,), (0.03, 0.0))],
    rank=11,
)
