"""Cyclic error of the scale: e sin(2 pi x / p), p the grating period."""

from collections.abc import Sequence

import numpy as np

from hil_sim.physics.sensor import scale_cyclic_error as physics
from reconcile.catalogue.entry import CatalogueEntry, PlausibleTerm, Rival
from reconcile.catalogue.kinds import OWN, RegressionData, ResidualChannel, ShapeParameters, TermFamily
from reconcile.catalogue.periodic import FEWEST_PERIODS, Wave, pair

PERIODS_M = (2e-6, 4e-6, 8e-6, 1e-5, 2e-5, 4e-5, 1e-4, 2e-4, 5e-4, 1e-3)
WAVE = Wave("period_m", "m", "amplitude_m", "m", ResidualChannel.POSITION_DEVIATION, sign=1.0)


def _shapes(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    """Periods far below a turn, of which the recordings cover two."""
    range_m = max(float(np.ptp(data.motion.position_m)) for data in datasets)
    longest_m = min(0.5 * datasets[0].lead_m, range_m / FEWEST_PERIODS)
    return [(period,) for period in PERIODS_M if period < longest_m]


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(
        TermFamily(
            lambda data, shape: pair(2.0 * np.pi / shape[0] * data.motion.position_m),
            _shapes,
            WAVE.channel,
            OWN,
        ),
    ),
    parameters_of=WAVE.parameters,
    sentence=lambda p: (
        f"the scale swings by {p['amplitude'] * 1e6:.2f} um every {p['period_m'] * 1e6:.1f} um: a cyclic "
        "error within its grating period; in the force it grows with the square of the speed"
    ),
    additive=True,
    to_plant=WAVE.to_plant,
    from_plant=WAVE.from_plant,
    rivals=(Rival("lead_error_periodic"), Rival("cogging")),
    shown_by="in the force it grows with the square of the speed",
    plausible=lambda _sizes: [PlausibleTerm((2e-5,), (1e-7, 0.0))],
    rank=21,
)
