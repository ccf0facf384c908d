"""Candidate terms without a name, for what no entry explains; an accepted one is reported as `unknown`."""

from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

from kernels.arrays import Array
from reconcile.catalogue.kinds import Parameter, RegressionData, ResidualChannel, ShapeParameters
from reconcile.catalogue.registry import CATALOGUE
from reconcile.catalogue.relaxation_terms import Relaxing, Ringing
from reconcile.catalogue.smooth_terms import PREFIX, SMOOTH_TERMS, Splines
from reconcile.catalogue.step_events import MOMENTS, SLIP


class UnnamedTerm(Protocol):
    """A family of candidate terms without a name."""

    def shapes(self, datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
        """Shape parameters to scan."""

    def columns(self, data: RegressionData, shape: ShapeParameters) -> Array:
        """Columns (n, k)."""

    def parameters(self, shape: ShapeParameters, coefficients: Array) -> dict[str, Parameter]:
        """What shape and coefficients mean, SI."""

    def sentence(self, p: dict[str, float]) -> str:
        """Explanation after `EXPLAINED_BY_NOTHING`."""


EXPLAINED_BY_NOTHING = "something real that no entry of the catalogue explains: "
SHARP = (*(f"moment_of_{name}" for name in (*MOMENTS, "slip")), "ringing", "relaxation")
"""Terms whose shape is one continuous number, which is refined."""
_SMOOTH: dict[str, UnnamedTerm] = {name: Splines(name) for name in SMOOTH_TERMS}
_FORCE: dict[str, UnnamedTerm] = {
    **_SMOOTH,
    **{f"moment_of_{name}": moment for name, moment in MOMENTS.items()},
    "ringing": Ringing(),
    "relaxation": Relaxing(),
}
_DEVIATION: dict[str, UnnamedTerm] = {**_SMOOTH, "moment_of_slip": SLIP}
TERMS = {ResidualChannel.FORCE: _FORCE, ResidualChannel.POSITION_DEVIATION: _DEVIATION}


def term(effect: str) -> UnnamedTerm:
    """By the candidate's effect, `unknown:...`."""
    name = effect.removeprefix(PREFIX)
    return _FORCE.get(name) or _DEVIATION[name]


def every_shape(
    datasets: Sequence[RegressionData], channel: ResidualChannel
) -> list[tuple[str, ShapeParameters]]:
    """Every candidate as (effect, shape)."""
    return [(PREFIX + name, shape) for name, of in TERMS[channel].items() for shape in of.shapes(datasets)]


class Meaning(NamedTuple):
    """What the coefficients of an effect, or of a term without a name, say."""

    parameters: Callable[[ShapeParameters, Array], dict[str, Parameter]]
    sentence: Callable[[dict[str, float]], str]
    equivalent: tuple[str, ...] = ()


def meaning_of(effect: str) -> Meaning:
    """By the catalogue's name, or `unknown:...`."""
    if effect.startswith(PREFIX):
        unnamed = term(effect)
        return Meaning(unnamed.parameters, lambda p: EXPLAINED_BY_NOTHING + unnamed.sentence(p))
    entry = CATALOGUE[effect]
    return Meaning(entry.parameters, entry.sentence, entry.equivalent)
