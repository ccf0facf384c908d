"""Friction that depends on the position, s Fc(x): it changes its sign with the direction."""

from hil_sim.physics.friction import position_dependent_friction as physics
from kernels.arrays import Array
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.entry import CatalogueEntry, Rival, UnseenTerm
from reconcile.catalogue.kinds import Parameter, RegressionData, ResidualChannel, ShapeParameters, TermFamily
from reconcile.catalogue.polynomial import coefficients_n, cubic, degrees, powers


def _columns(data: RegressionData, shape: ShapeParameters) -> Array:
    columns: Array = data.motion.direction[:, None] * powers(data, shape)
    return columns


def _parameters(shape: ShapeParameters, coefficients: Array) -> dict[str, Parameter]:
    """Change of the friction level over half the travel."""
    return coefficients_n(shape, coefficients)


def _sentence(p: dict[str, float]) -> str:
    largest_n = max(abs(value) for key, value in p.items() if key.startswith("power"))
    return (
        f"friction differs along the travel, by about {largest_n:.2f} N, and "
        "changes its sign "
        "with the direction: position-dependent friction; a spring or cable would not"
    )


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    shape, powers_n = cubic(of)
    return [ModelTerm(ENTRY.name, shape, powers_n, ResidualChannel.FORCE)] if powers_n else []


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(ResidualChannel.FORCE, degrees, _columns),),
    parameters=_parameters,
    sentence=_sentence,
    from_plant=_from_plant,
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
    unseen=lambda sizes: [UnseenTerm(sizes.over_travel, (sizes.small_n, sizes.small_n))],
    rank=7,
)
