"""Force that depends on the position: a cable chain, a spring, an incline; even in the direction."""

from functools import partial

from hil_sim.physics.load import position_dependent_force as physics
from reconcile.catalogue.entry import CatalogueEntry, PlausibleTerm, Rival
from reconcile.catalogue.kinds import TermFamily
from reconcile.catalogue.polynomial import coefficients_n, cubic, degrees, largest_n, powers

ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(powers, degrees),),
    parameters_of=lambda shape, coefficients: coefficients_n(shape, -coefficients),
    sentence=lambda p: (
        f"the force changes along the travel, by about {largest_n(p):.2f} N, alike in both directions: "
        "a spring, a cable chain or an incline; friction would change its sign"
    ),
    from_plant=partial(cubic, sign=-1.0),
    rivals=(
        Rival("position_dependent_friction"),
        Rival("constant_force", "at several places a constant force is the same"),
    ),
    shown_by="over the same places it does not ask for the direction",
    experiment="one by one",
    plausible=lambda sizes: [PlausibleTerm(sizes.over_travel, (sizes.small_n, sizes.small_n))],
    rank=8,
)
