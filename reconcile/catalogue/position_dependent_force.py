"""Force that depends on the position: a cable chain, a spring, an incline; even in the direction."""

from hil_sim.physics.load import position_dependent_force as physics
from kernels.arrays import Array
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.entry import CatalogueEntry, Rival, UnseenTerm
from reconcile.catalogue.kinds import Parameter, RegressionData, ResidualChannel, ShapeParameters, TermFamily
from reconcile.catalogue.polynomial import coefficients_n, cubic, degrees, powers


def _columns(data: RegressionData, shape: ShapeParameters) -> Array:
    columns: Array = powers(data, shape)
    return columns


def _parameters(shape: ShapeParameters, coefficients: Array) -> dict[str, Parameter]:
    """Force on the table over half the travel."""
    return coefficients_n(shape, -coefficients)


def _sentence(p: dict[str, float]) -> str:
    largest_n = max(abs(value) for key, value in p.items() if key.startswith("power"))
    return (
        f"the force changes along the travel, by about {largest_n:.2f} N, alike in "
        "both "
        "directions: a spring, a cable chain or an incline; friction would change its sign"
    )


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    shape, powers_n = cubic(of)
    return (
        [ModelTerm(ENTRY.name, shape, tuple(-c for c in powers_n), ResidualChannel.FORCE)] if powers_n else []
    )


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(ResidualChannel.FORCE, degrees, _columns),),
    parameters=_parameters,
    sentence=_sentence,
    from_plant=_from_plant,
    rivals=(
        Rival("position_dependent_friction"),
        Rival("constant_force", "at several places a constant force is the same"),
    ),
    shown_by="over the same places it does not ask for the direction",
    experiment="one by one",
    unseen=lambda sizes: [UnseenTerm(sizes.over_travel, (sizes.small_n, sizes.small_n))],
    rank=8,
)
