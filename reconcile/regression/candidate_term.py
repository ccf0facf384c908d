"""Terms that a model of a residual channel may have."""

from collections.abc import Sequence
from typing import NamedTuple

from reconcile.catalogue.kinds import ShapeParameters
from reconcile.catalogue.registry import DRIFTING_COLUMNS

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

    @property
    def levels(self) -> tuple[int, ...]:
        """Columns that are levels of each recording, behind those that drift; most terms have none."""
        return self.columns[DRIFTING_COLUMNS.get(self.effect, len(self.columns)) :]


def effect_names(chosen: Sequence[CandidateTerm]) -> list[str]:
    """Distinct effects of the terms, in order."""
    return list(dict.fromkeys(candidate.effect for candidate in chosen))
