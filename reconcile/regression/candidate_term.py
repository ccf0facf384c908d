"""Terms that a model of a residual channel may have."""

from collections.abc import Sequence
from typing import NamedTuple

from reconcile.catalogue.kinds import ShapeParameters

TermKey = tuple[str, ShapeParameters, bool]


class CandidateTerm(NamedTuple):
    """One term at one set of shape parameters, with its column indices in the normal equations."""

    effect: str
    shape_parameters: ShapeParameters
    per_recording: bool
    columns: tuple[int, ...]

    @property
    def key(self) -> TermKey:
        """Identity of the term, the same in any normal equations."""
        return self.effect, self.shape_parameters, self.per_recording


def effect_names(chosen: Sequence[CandidateTerm]) -> list[str]:
    """Distinct effects of the terms, in order."""
    return list(dict.fromkeys(candidate.effect for candidate in chosen))
