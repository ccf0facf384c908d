"""Periodic lead error: scale less motor repeats once a turn of the screw, or a few times."""

from collections.abc import Sequence

from hil_sim.physics.transmission import lead_error_periodic as physics
from reconcile.catalogue.entry import CatalogueEntry, IndicatorKind, PlausibleTerm, Rival
from reconcile.catalogue.kinds import EITHER, RegressionData, ResidualChannel, ShapeParameters, TermFamily
from reconcile.catalogue.periodic import Wave, covered, over_turns

HARMONICS = (1, 2, 3, 4, 6, 8)
WAVE = Wave("harmonic", "1/turn", "amplitude_m", "m", ResidualChannel.POSITION_DEVIATION, sign=1.0)


def _shapes(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    return covered(datasets, HARMONICS)


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(over_turns, _shapes, WAVE.channel, EITHER),),
    parameters_of=WAVE.parameters,
    sentence=lambda p: (
        f"scale less motor swings by {p['amplitude'] * 1e6:.2f} um {p['harmonic']:g} times a turn: a "
        "periodic lead error, or an eccentric encoder; a third sensor would tell"
    ),
    additive=True,
    # distinguished by a third sensor only
    equivalent=("encoder_eccentricity",),
    indicators=(IndicatorKind("once_a_turn_m", "m", "deviation once a turn of the screw", (1.0,)),),
    to_plant=WAVE.to_plant,
    from_plant=WAVE.from_plant,
    fixed_to_screw=True,
    rivals=(
        Rival(
            "encoder_eccentricity",
            "the table itself swings once a turn only if it is the screw",
            experiment="third sensor",
        ),
        Rival("backlash", "a play steps wherever the motion turns"),
        Rival("scale_cyclic_error", "evenly over several turns each pitch repeats as often as it must"),
    ),
    shown_by="it repeats once a turn at any speed",
    plausible=lambda _sizes: [PlausibleTerm((1.0,), (1e-6, 0.0))],
    rank=20,
)
