"""Presliding: friction builds up over the distance since the reversal (Dahl 1968; LuGre and GMS alike).

Dahl's exponent tells how: 1 is the bristle's exponential, below it the contact gives way at last and at once,
above it long before.
"""

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize_scalar

from hil_sim.physics.friction import presliding_hysteresis as physics
from kernels.arrays import Array
from reconcile.catalogue.conversion import IdentifiedTerms, ModelTerm, PlantValues
from reconcile.catalogue.entry import POSITIVE, CatalogueEntry, PlausibleTerm, Rival
from reconcile.catalogue.kinds import RegressionData, ShapeParameters, TermFamily
from reconcile.recording.kinematics import dahl_deflection

DISTANCES_M = (1e-6, 2e-6, 4e-6, 8e-6, 1.5e-5, 3e-5, 6e-5, 1.2e-4)
EXPONENTS = (1.0, 0.5, 2.0)
COMPARED_M = np.geomspace(1e-7, 1e-3, 60)
"""Distances since the reversal at which two curves are compared."""


def _shapes(_datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    """The distance over which 63 % build up from rest, and Dahl's exponent."""
    return [(distance, exponent) for distance in DISTANCES_M for exponent in EXPONENTS]


def _columns(data: RegressionData, shape: ShapeParameters) -> Array:
    m, (distance_m, exponent) = data.motion, shape
    deflection_m = distance_m / _built_up_over(exponent)
    return (dahl_deflection(m.position_m, deflection_m, exponent) - m.direction)[:, None]


def _built_up_over(exponent: float) -> float:
    """Distance over which 1 - 1/e build up, for dz/dx = (1 - z)^exponent."""
    power = 1.0 - exponent
    return -math.expm1(-power) / power if power else 1.0


def _to_plant(found: IdentifiedTerms, notes: list[str]) -> PlantValues:
    """One level and distance: of several terms, those whose curve is nearest to the sum of the curves."""
    levels_n = np.array([term["level_n"] for term in found.terms])
    distances_m = np.array([term["way_m"] for term in found.terms])
    if len(distances_m) == 1:
        return dict(found.terms[0])
    total_n = float(levels_n.sum())
    wanted_n = -np.expm1(-COMPARED_M[:, None] / distances_m) @ levels_n

    def misfit(logarithm: float) -> float:
        one_n = -total_n * np.expm1(-COMPARED_M / math.exp(logarithm))
        return float(np.sum((one_n - wanted_n) ** 2))

    bounds = math.log(0.5 * distances_m.min()), math.log(2.0 * distances_m.max())
    distance_m = math.exp(minimize_scalar(misfit, bounds=bounds, method="bounded").x)
    notes.append(
        f"{ENTRY.name}: {len(distances_m)} ways were found, the plant takes one; {distance_m * 1e6:.3g} um "
        "comes nearest"
    )
    return {"level_n": total_n, "way_m": distance_m}


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(_columns, _shapes),),
    coefficients={"level_n": "N"},
    shape_parameters={"way_m": "m", "exponent": ""},
    sentence=lambda p: (
        f"after a reversal {abs(p['level_n']):.2f} N of friction build up over {p['way_m'] * 1e6:.1f} um of "
        "way, whatever the speed: presliding; Stribeck friction would show at slow constant speeds too"
    ),
    physical=POSITIVE,
    additive=True,
    continuous_shape_parameters=1,
    ends_with_reversal=True,
    on_every_axis=True,
    to_plant=_to_plant,
    from_plant=lambda of: [ModelTerm(of.effect, (of.params.way_m, 1.0), (of.params.level_n,))],
    rivals=(
        Rival("stribeck_friction"),
        Rival(
            "backlash", "within its play the scale stands still; presliding lets it follow against a force"
        ),
        Rival("dwell_dependent_breakaway", "presliding is the same after any rest"),
        Rival("current_loop_lag", "presliding goes by the way since the reversal, a lag by the time"),
        Rival("transport_delay", "presliding goes by the way since the reversal, a delay by the time"),
        Rival("torque_ripple", "over strokes far below a turn there is no ripple"),
    ),
    shown_by="the force turns over a way, however slow the reversal",
    plausible=lambda sizes: [PlausibleTerm((2e-5, 1.0), (0.5 * sizes.coulomb_n,))],
    rank=2,
)
