"""What is seen of one difference of one axis: the material of `located` and of every picture."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from reconcile.locate import as_json, locate
from reconcile.locate_noise import noise_floor, noise_json, whiteness
from reconcile.locate_pitches import pitches_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Sense
    from reconcile.explain import Explanation
    from reconcile.locate import Located
    from reconcile.locate_noise import NoiseFloor, Whiteness
    from reconcile.locate_pitches import Pitches
    from reconcile.model_file import NominalAxis
    from reconcile.rests import Rest

    Array = NDArray[np.float64]

MODELS = ("before", "refitted", "after")
"""Nominal values, fitted values, fitted values and the effects that were found."""
WORTH_TELLING = 0.002
"""Share from which a place is in the verdict."""


class View(NamedTuple):
    """One sense of one axis."""

    axis: str
    sense: Sense
    rests: list[Rest]
    located: list[Located]
    floor: NoiseFloor
    white: dict[str, Whiteness]
    """By model."""
    pitches: Pitches


def views(explanations: Mapping[str, Sequence[Explanation]], axes: Mapping[str, NominalAxis]) -> list[View]:
    """Of a whole diagnosis, axis by axis."""
    return [
        view(name, one.sense, one.rests, axes[name], one.base.get("mass_kg", axes[name].mass_kg))
        for name, of_axis in explanations.items()
        for one in of_axis
    ]


def view(name: str, sense: Sense, rests: list[Rest], axis: NominalAxis, mass_kg: float) -> View:
    """Of one difference; `mass_kg` as fitted."""
    white = {model: whiteness(rests, of_model(rests, model)) for model in MODELS}
    floor = noise_floor(rests, sense, mass_kg)
    return View(name, sense, rests, locate(rests, sense, axis), floor, white, pitches_of(axis))


def of_model(rests: Sequence[Rest], model: str) -> list[Array]:
    """The rests that a model leaves, by recording."""
    return [getattr(rest, model) for rest in rests]


def verdict_places(seen: Sequence[View]) -> list[dict[str, Any]]:
    """`located` of verdict.json: all that is worth telling, by difference, the largest share first."""
    return [as_json(one.axis, place) for one in seen for place in one.located if place.share >= WORTH_TELLING]


def verdict_noise(seen: Sequence[View]) -> dict[str, dict[str, Any]]:
    """`noise_floor` of verdict.json, by axis and sense."""
    found: dict[str, dict[str, Any]] = {}
    for one in seen:
        found.setdefault(one.axis, {})[one.sense.value] = noise_json(one.floor, one.white)
    return found
