"""Presliding: friction builds up over the distance since the reversal (Dahl 1968; LuGre and GMS alike).

Dahl's exponent is the shape: 1 is an exponential; below it the contact yields later and faster, above it
earlier. 0 is an elastic element that slips abruptly; a sum of these is the Maxwell slip model of GMS.
"""

from collections.abc import Sequence

import numpy as np

from hil_sim.physics.friction import presliding_elements
from hil_sim.physics.friction import presliding_hysteresis as physics
from kernels.arrays import Array
from kernels.quantities import section_of
from reconcile.catalogue.conversion import IdentifiedTerms, ModelTerm, PlantValues
from reconcile.catalogue.entry import POSITIVE, CatalogueEntry, PlausibleTerm, Rival
from reconcile.catalogue.kinds import RegressionData, ShapeParameters, TermFamily, continued
from reconcile.recording.kinematics import dahl_deflection

DISTANCES_M = (1e-6, 2e-6, 4e-6, 8e-6, 1.5e-5, 3e-5, 6e-5, 1.2e-4)
EXPONENTS = (1.0, 0.5, 2.0)
SLIP_DISTANCES_M = tuple(float(d) for d in np.geomspace(3.5e-7, 1.28e-4, 18))
"""Distances of elements that slip abruptly."""
LONGEST_OF_TRAVEL = 2.5e-3
"""Longest distance on a rotary axis, over its travel; the lists above are for guides and screws. Chosen: 0.3
degrees of a joint that turns by two radians."""


def _shapes(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    """The distance over which 63 % build up from rest, and Dahl's exponent."""
    travel = max(float(np.ptp(data.motion.position_m)) for data in datasets)
    longest = LONGEST_OF_TRAVEL * travel if datasets[0].rotary else 0.0
    distances, slips = continued(DISTANCES_M, longest), continued(SLIP_DISTANCES_M, longest)
    smooth = [(distance, exponent) for distance in distances for exponent in EXPONENTS]
    return [*smooth, *((distance, 0.0) for distance in slips)]


def _columns(data: RegressionData, shape: ShapeParameters) -> Array:
    m, (distance_m, exponent) = data.motion, shape
    deflection_m = presliding_elements.element_distance_m(distance_m, exponent)
    return (dahl_deflection(m.position_m, deflection_m, exponent) - m.direction)[:, None]


def _plant_effect(found: IdentifiedTerms) -> str:
    """Return presliding_hysteresis for one exponential, else presliding_elements."""
    simple = len(found.terms) == 1 and found.terms[0].get("exponent", 1.0) == 1.0
    return section_of(physics if simple else presliding_elements)


def _to_plant(found: IdentifiedTerms, notes: list[str]) -> PlantValues:
    """Level, distance and exponent of each term; of more than the plant takes those of the highest level."""
    if _plant_effect(found) == ENTRY.name:
        return dict(found.terms[0])
    ordered = sorted(found.terms, key=lambda term: term["level_n"], reverse=True)
    kept, left = ordered[: presliding_elements.ELEMENTS_MAX], ordered[presliding_elements.ELEMENTS_MAX :]
    notes += [
        f"{ENTRY.name}: {term['level_n']:.3g} N over {term['way_m'] * 1e6:.3g} um is left out, the plant "
        f"takes {presliding_elements.ELEMENTS_MAX} elements"
        for term in left
    ]
    level_n = sum(term["level_n"] for term in kept)
    return {
        "level_n": level_n,
        "share": [term["level_n"] / level_n for term in kept],
        "way_m": [term["way_m"] for term in kept],
        "exponent": [term.get("exponent", 1.0) for term in kept],
    }


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
    plant_effect=_plant_effect,
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
