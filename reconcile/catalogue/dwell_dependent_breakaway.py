"""Breakaway that grows with the rest before it: Fs(t) = Fs_inf - D exp(-t / tau)."""

from collections.abc import Sequence

import numpy as np

from hil_sim.physics.friction import dwell_dependent_breakaway as physics
from kernels.arrays import Array
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.entry import POSITIVE, CatalogueEntry, PlausibleTerm, Rival
from reconcile.catalogue.kinds import RegressionData, ShapeParameters, SiParameter, TermFamily

DISTANCES_M = (3e-6, 1e-5, 3e-5)
TIMES_S = (0.2, 1.0, 5.0)


def _shapes(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    """Distance over which the peak is lost, and time constant; none with fewer than three standstills."""
    rests_s = np.unique(np.concatenate([data.motion.dwell_s for data in datasets]))
    if np.count_nonzero(rests_s > 0.05) < 3:
        return []
    return [(distance, time) for distance in DISTANCES_M for time in TIMES_S]


def _columns(data: RegressionData, shape: ShapeParameters) -> Array:
    m, (distance_m, time_s) = data.motion, shape
    grown = -np.expm1(-m.dwell_s / time_s) * np.exp(-m.distance_since_standstill_m / distance_m)
    column: Array = (m.last_direction * grown)[:, None]
    return column


def _parameters(shape: ShapeParameters, coefficients: Array) -> dict[str, SiParameter]:
    """D, tau, and the distance."""
    distance_m, time_s = shape
    return {
        "growth_n": SiParameter(float(coefficients[0]), "N"),
        "time_s": SiParameter(time_s, "s"),
        "way_m": SiParameter(distance_m, "m"),
    }


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    p = of.params
    return [ModelTerm(of.effect, (p.way_m, p.time_s), (p.growth_n,))]


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(_columns, _shapes),),
    parameters_of=_parameters,
    sentence=lambda p: (
        f"the first force after a rest is up to {p['growth_n']:.2f} N higher, the longer the rest "
        f"(time constant about {p['time_s']:.1f} s): breakaway that grows with the dwell"
    ),
    physical=POSITIVE,  # friction grows at rest
    presliding_can_imitate=True,
    from_plant=_from_plant,
    rivals=(
        Rival("stribeck_friction"),
        Rival("presliding_hysteresis"),
        Rival("temperature_dependent_friction", "in mixed order, what grows with the rest is not a drift"),
    ),
    shown_by="the first peak grows with the rest before it",
    plausible=lambda sizes: [PlausibleTerm((1e-5, 1.0), (sizes.large_n,))],
    rank=3,
)
