"""Force that depends on the position: a cable chain, a spring, an incline; even in the direction."""

import math
from collections.abc import Sequence
from functools import partial

from hil_sim.physics.load import position_dependent_force as physics
from reconcile.catalogue import gravity
from reconcile.catalogue.entry import CatalogueEntry, PlausibleTerm, Rival
from reconcile.catalogue.kinds import RegressionData, ShapeParameters, TermFamily
from reconcile.catalogue.polynomial import coefficients_n, cubic, degrees, largest_n, passed_once, powers


def _shapes(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    """None on a rotary axis that made less than half a turn, where a weight is tried.

    A line and a sine are alike there, and a joint without a weight is rare.
    """
    range_rad = gravity.range_rad(datasets)
    return [] if gravity.LEAST_RANGE_RAD <= range_rad < math.pi else degrees(datasets)


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(powers, _shapes),),
    parameters_of=lambda shape, coefficients: coefficients_n(shape, -coefficients),
    sentence=lambda p: (
        f"the force changes along the travel, by about {largest_n(p):.2f} N, alike in both directions: "
        "a spring, a cable chain or an incline; friction would change its sign"
    ),
    from_plant=partial(cubic, sign=-1.0),
    refused=passed_once,
    rivals=(
        Rival("position_dependent_friction"),
        Rival("constant_force", "at several places a constant force is the same"),
    ),
    shown_by="over the same places it does not ask for the direction",
    experiment="one by one",
    plausible=lambda sizes: [PlausibleTerm(sizes.over_travel, (sizes.small_n, sizes.small_n))],
    curve_near="position",
    rank=8,
)
