"""Friction that depends on the position, s Fc(x): it changes its sign with the direction."""

from functools import partial

from hil_sim.physics.friction import position_dependent_friction as physics
from kernels.arrays import Array
from reconcile.catalogue.entry import CatalogueEntry, PlausibleTerm, Rival
from reconcile.catalogue.kinds import RegressionData, ShapeParameters, TermFamily
from reconcile.catalogue.polynomial import coefficients_n, cubic, degrees, largest_n, passed_once, powers


def _columns(data: RegressionData, shape: ShapeParameters) -> Array:
    columns: Array = data.motion.direction[:, None] * powers(data, shape)
    return columns


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(_columns, degrees),),
    parameters_of=coefficients_n,
    sentence=lambda p: (
        f"friction differs along the travel, by about {largest_n(p):.2f} N, and changes its sign with the "
        "direction: position-dependent friction; a spring or cable would not"
    ),
    from_plant=partial(cubic, sign=1.0),
    refused=passed_once,
    rivals=(
        Rival(
            "position_dependent_force",
            "over the same places both ways, friction changes its sign with the direction",
        ),
        Rival(
            "temperature_dependent_friction",
            "a place keeps its friction when the axis is warm",
            experiment="warm",
        ),
    ),
    shown_by="what changes with the place changes sign with direction",
    plausible=lambda sizes: [PlausibleTerm(sizes.over_travel, (sizes.small_n, sizes.small_n))],
    curve_over="position_by_direction",
    rank=7,
)
