"""All that is tried where no effect of the catalogue explains what is left; what they find is `unknown`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from reconcile.catalogue.kinds import Sense
from reconcile.memory import Relaxing, Ringing
from reconcile.moments import MOMENTS, SLIP
from reconcile.smooth_terms import PREFIX, SMOOTH_TERMS, Splines

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Parameter, Scene, Shape

    Array = NDArray[np.float64]


class Term(Protocol):
    """Columns that stand for something real without a name."""

    def shapes(self, scenes: Sequence[Scene]) -> list[Shape]:
        """What is scanned."""

    def columns(self, scene: Scene, shape: Shape) -> Array:
        """Columns (n, k)."""

    def parameters(self, shape: Shape, coefficients: Array) -> dict[str, Parameter]:
        """In SI."""

    def sentence(self, p: dict[str, float]) -> str:
        """Where to look."""


SHARP = (*(f"moment_of_{name}" for name in (*MOMENTS, "slip")), "ringing", "relaxation")
"""Those whose shape is one number that can be any."""
_OVER: dict[str, Term] = {name: Splines(name) for name in SMOOTH_TERMS}
_MEMORY: dict[str, Term] = {"ringing": Ringing(), "relaxation": Relaxing()}
_FORCE: dict[str, Term] = {
    **_OVER,
    **{f"moment_of_{name}": moment for name, moment in MOMENTS.items()},
    **_MEMORY,
}
_DEVIATION: dict[str, Term] = {**_OVER, "moment_of_slip": SLIP}
TERMS = {Sense.FORCE: _FORCE, Sense.DEVIATION: _DEVIATION}


def term(effect: str) -> Term:
    """Of a candidate's effect, `unknown:...`."""
    name = effect.removeprefix(PREFIX)
    return _FORCE.get(name) or _DEVIATION[name]


def every_shape(scenes: Sequence[Scene], sense: Sense) -> list[tuple[str, Shape]]:
    """All that can be tried, by the candidate's effect."""
    return [(PREFIX + name, shape) for name, of in TERMS[sense].items() for shape in of.shapes(scenes)]


class Unknown:
    """What is said of one, in the form of an entry of the catalogue."""

    EQUIVALENT: Sequence[str] = ()

    def __init__(self, effect: str) -> None:
        self.parameters, self.sentence = term(effect).parameters, term(effect).sentence
