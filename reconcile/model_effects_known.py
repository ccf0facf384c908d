"""An effect that a model holds, in terms of the catalogue; and what tells its size."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from reconcile.catalogue.kinds import Scene, Sense, Shape
    from reconcile.model_file import NominalAxis


class Known(NamedTuple):
    """A hypothesis of the catalogue that a model has made already."""

    effect: str
    shape: Shape
    coefficients: tuple[float, ...]
    """Of the columns of that shape."""
    sense: Sense


class Asked(NamedTuple):
    """One effect of a plant, and what its numbers refer to."""

    params: Any
    """hil_sim's, in SI."""
    effects: Mapping[str, Any]
    """All that the model holds of the axis."""
    other: str
    """The axis that cross_axis_coupling follows."""
    axis: NominalAxis
    base: Mapping[str, float]
    """Mass, viscous and Coulomb friction, all that there is of them."""
    scenes: Sequence[Scene]
    """At least one."""
