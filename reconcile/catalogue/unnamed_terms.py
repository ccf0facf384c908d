"""The unnamed terms, for residuals that no entry explains; an accepted one is reported as `unknown`."""

from collections.abc import Callable, Sequence

from kernels.arrays import Array
from reconcile.catalogue.entry import CatalogueEntry
from reconcile.catalogue.kinds import RegressionData, ResidualChannel, ShapeParameters, UnnamedTerm
from reconcile.catalogue.map_term import MAP, MAP_TERM
from reconcile.catalogue.registry import CATALOGUE, family
from reconcile.catalogue.relaxation_terms import RELAXATION, RINGING
from reconcile.catalogue.smooth_terms import PREFIX, SMOOTH_TERMS
from reconcile.catalogue.step_events import MOMENTS, SLIPS

SHARP = (*(f"moment_of_{name}" for name in (*MOMENTS, *SLIPS)), "ringing", "relaxation")
"""Terms with one continuous shape parameter, which is refined."""
_FORCE = {
    **SMOOTH_TERMS,
    **{f"moment_of_{name}": moment for name, moment in MOMENTS.items()},
    "ringing": RINGING,
    "relaxation": RELAXATION,
    MAP: MAP_TERM,
}
_DEVIATION = {**SMOOTH_TERMS, **{f"moment_of_{name}": slip for name, slip in SLIPS.items()}}
TERMS = {ResidualChannel.FORCE: _FORCE, ResidualChannel.POSITION_DEVIATION: _DEVIATION}


def term(effect: str) -> UnnamedTerm:
    """Return an unnamed term by its effect, `unknown:...`."""
    name = effect.removeprefix(PREFIX)
    return _FORCE.get(name) or _DEVIATION[name]


def other_shapes(
    datasets: Sequence[RegressionData], channel: ResidualChannel
) -> list[tuple[str, ShapeParameters]]:
    """Return every candidate that is neither a smooth term nor a step event, as (effect, shape)."""
    others = {name: of for name, of in TERMS[channel].items() if name in {"ringing", "relaxation"}}
    return [(PREFIX + name, shape) for name, of in others.items() for shape in of.shapes(datasets)]


def columns_of(
    effect: str, channel: ResidualChannel
) -> Callable[[RegressionData, ShapeParameters], Array] | None:
    """Return the columns of a term by its effect's name or `unknown:...`; None if the channel has none."""
    if effect.startswith(PREFIX):
        return TERMS[channel][effect.removeprefix(PREFIX)].columns
    of = family(effect, channel)
    return of.columns if of else None


def meaning_of(effect: str) -> CatalogueEntry | UnnamedTerm:
    """Return the declaration of a term by the catalogue's name or `unknown:...`."""
    return term(effect) if effect.startswith(PREFIX) else CATALOGUE[effect]
