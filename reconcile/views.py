"""What is seen of one difference of one axis: the material of `located` and of every picture."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from reconcile.locate import as_json, in_phase, locate
from reconcile.locate_coordinates import coordinates
from reconcile.locate_noise import noise_floor, noise_json, whiteness
from reconcile.locate_pitches import pitches_of
from reconcile.locate_share import joined, samples, share

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Sense
    from reconcile.explain import Explanation
    from reconcile.locate import Located
    from reconcile.locate_coordinates import Coordinate
    from reconcile.locate_noise import NoiseFloor, Whiteness
    from reconcile.locate_pitches import Pitches
    from reconcile.model_file import NominalAxis
    from reconcile.rests import Rest

    Array = NDArray[np.float64]

MODELS = ("before", "refitted", "after")
"""Nominal values, fitted values, fitted values and the effects that were found."""
WORTH_TELLING = 0.002
"""Share from which a place is in the verdict."""
MOST_PROFILES = 6


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


class Profile(NamedTuple):
    """The means over the bins of a coordinate, by model; turned round with the direction `by_direction`."""

    coordinate: Coordinate
    by_direction: bool
    share: float
    means: dict[str, Array]
    errors: dict[str, Array]
    counts: Array


def views(explanations: Mapping[str, Sequence[Explanation]], axes: Mapping[str, NominalAxis]) -> list[View]:
    """Of a whole diagnosis, axis by axis."""
    return [view(name, e, axes[name]) for name, of_axis in explanations.items() for e in of_axis]


def view(name: str, explanation: Explanation, axis: NominalAxis) -> View:
    """Of one difference."""
    rests, sense = explanation.rests, explanation.sense
    white = {model: whiteness(rests, of_model(rests, model)) for model in MODELS}
    mass_kg = explanation.base.get("mass_kg", axis.mass_kg)
    floor = noise_floor(rests, sense, mass_kg)
    return View(name, sense, rests, locate(rests, sense, axis), floor, white, pitches_of(axis))


def of_model(rests: Sequence[Rest], model: str) -> list[Array]:
    """The rests that a model leaves, by recording."""
    return [getattr(rest, model) for rest in rests]


def profiles(seen: View) -> list[Profile]:
    """Over the coordinates that explain most, the best first; those that explain nothing only to be three."""
    by_name = {coordinate.name: coordinate for coordinate in coordinates(seen.rests, seen.sense)}
    found = [one for one in seen.located if one.coordinate in by_name]
    worth = max(sum(one.share >= WORTH_TELLING for one in found), 3)
    return [
        _profile(seen, by_name[one.coordinate], one.by_direction, one.share)
        for one in found[: min(worth, MOST_PROFILES)]
    ]


def since_reversal(seen: View) -> dict[str, Profile]:
    """Over the way since the last reversal, by direction: `forwards`, `backwards`."""
    by_name = {coordinate.name: coordinate for coordinate in coordinates(seen.rests, seen.sense)}
    return _ways(seen, by_name.get("distance_since_reversal"))


def over_travel(seen: View) -> dict[str, Profile]:
    """Over the position, by direction: `forwards`, `backwards`."""
    by_name = {coordinate.name: coordinate for coordinate in coordinates(seen.rests, seen.sense)}
    return _ways(seen, by_name.get("position"))


def verdict_places(seen: Sequence[View]) -> list[dict[str, Any]]:
    """`located` of verdict.json: all that is worth telling, by difference, the largest share first."""
    return [as_json(one.axis, place) for one in seen for place in one.located if place.share >= WORTH_TELLING]


def verdict_noise(seen: Sequence[View]) -> dict[str, dict[str, Any]]:
    """`noise_floor` of verdict.json, by axis and sense."""
    found: dict[str, dict[str, Any]] = {}
    for one in seen:
        found.setdefault(one.axis, {})[one.sense.value] = noise_json(one.floor, one.white)
    return found


def _ways(seen: View, coordinate: Coordinate | None) -> dict[str, Profile]:
    if coordinate is None:
        return {}
    found = {}
    for name, way in (("forwards", 1.0), ("backwards", -1.0)):
        one_way = [
            np.where(rest.scene.motion.last_direction == way, bins, -1)
            for rest, bins in zip(seen.rests, coordinate.bins, strict=True)
        ]
        found[name] = _profile(seen, coordinate._replace(bins=one_way), by_direction=False, part=0.0)
    return found


def _profile(seen: View, coordinate: Coordinate, by_direction: bool, part: float) -> Profile:
    bins = joined(coordinate, seen.rests)
    shares = {}
    for model in (*MODELS, "measured"):
        values = [
            in_phase(rest, of) for rest, of in zip(seen.rests, of_model(seen.rests, model), strict=True)
        ]
        given = samples(seen.rests, values)
        shares[model] = share(given, bins, coordinate.size, turned=by_direction)
    return Profile(
        coordinate,
        by_direction,
        part,
        {model: one.mean for model, one in shares.items()},
        {model: one.errors for model, one in shares.items()},
        shares["after"].counts,
    )
