"""Means of a difference over the coordinates it was located in, by model: the stuff of pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from reconcile.locate import in_phase
from reconcile.locate_coordinates import coordinates
from reconcile.locate_share import joined, samples, share
from reconcile.views import MODELS, WORTH_TELLING, of_model

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from reconcile.locate_coordinates import Coordinate
    from reconcile.views import View

    Array = NDArray[np.float64]

FEWEST, MOST = 3, 6
"""Coordinates that are drawn."""


class Profile(NamedTuple):
    """The means over the bins of a coordinate, by model; turned round with the direction `by_direction`."""

    coordinate: Coordinate
    by_direction: bool
    share: float
    means: dict[str, Array]
    errors: dict[str, Array]
    counts: Array


class Profiles:
    """Of one difference."""

    def __init__(self, seen: View) -> None:
        self._seen = seen
        self._by_name = {coordinate.name: coordinate for coordinate in coordinates(seen.rests, seen.sense)}
        self._given = {}
        for model in (*MODELS, "measured"):
            pairs = zip(seen.rests, of_model(seen.rests, model), strict=True)
            self._given[model] = samples(seen.rests, [in_phase(rest, values) for rest, values in pairs])

    def best(self) -> list[Profile]:
        """Over the coordinates that explain most, the best first; at least a few."""
        found = [one for one in self._seen.located if one.coordinate in self._by_name]
        worth = max(sum(one.share >= WORTH_TELLING for one in found), FEWEST)
        return [
            self._profile(self._by_name[one.coordinate], by_direction=one.by_direction, part=one.share)
            for one in found[: min(worth, MOST)]
        ]

    def by_way(self, name: str) -> dict[str, Profile]:
        """Over a coordinate, `forwards` and `backwards`; empty where the recordings do not have it."""
        coordinate = self._by_name.get(name)
        if coordinate is None:
            return {}
        found = {}
        for way, sign in (("forwards", 1.0), ("backwards", -1.0)):
            one_way = [
                np.where(rest.scene.motion.last_direction == sign, bins, -1)
                for rest, bins in zip(self._seen.rests, coordinate.bins, strict=True)
            ]
            found[way] = self._profile(coordinate._replace(bins=one_way), by_direction=False, part=0.0)
        return found

    def _profile(self, coordinate: Coordinate, *, by_direction: bool, part: float) -> Profile:
        bins = joined(coordinate, self._seen.rests)
        shares = {
            model: share(given, bins, coordinate.size, turned=by_direction)
            for model, given in self._given.items()
        }
        return Profile(
            coordinate,
            by_direction,
            part,
            {model: one.mean for model, one in shares.items()},
            {model: one.errors for model, one in shares.items()},
            shares["after"].counts,
        )
