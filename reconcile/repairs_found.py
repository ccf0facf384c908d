"""A finding on its way into a plant file: its numbers, and what they refer to."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from reconcile.catalogue.kinds import Scene
    from reconcile.findings import Finding
    from reconcile.model_file import NominalAxis

    Term = dict[str, float]


class NotInAPlant(Exception):  # noqa: N818  # it is no error: it is said in the verdict
    """No plant can have what was found."""


class Found(NamedTuple):
    """A finding, and what its numbers refer to."""

    finding: Finding
    scenes: Sequence[Scene]
    sources: Sequence[str]
    base: Mapping[str, float]
    """Mass, viscous and Coulomb friction as fitted in the force; empty where they were not."""
    axis: NominalAxis

    @property
    def terms(self) -> list[Term]:
        """Parameters of each of the hypotheses that make up the finding."""
        p = {key: estimate.value for key, estimate in self.finding.parameters.items()}
        count = len(self.finding.candidates)
        if count < 2:
            return [p]
        ends = [f"_{number}" for number in range(1, count + 1)]
        return [{key.removesuffix(end): p[key] for key in p if key.endswith(end)} for end in ends]
