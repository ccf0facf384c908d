"""Smooth terms: what is real but in no catalogue, told by the coordinate that it lives in.

Each is a set of triangular splines over one coordinate, even in the direction of motion or odd. They are what
`unknown` is modelled by.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from reconcile.catalogue.kinds import Parameter

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Shape

    Array = NDArray[np.float64]

KNOTS = 9
PREFIX = "unknown:"
"""In front of the coordinate, where a smooth term stands among the candidates."""


class SmoothTerm(NamedTuple):
    """A coordinate that something can live in."""

    unit: str
    coordinate: Callable[[Scene], Array]
    """(n,)"""
    factor: Callable[[Scene], Array] | None = None
    """(n,) by which the height is multiplied: the direction of motion, the acceleration."""
    decades: float = 0.0
    """Spaced by the logarithm, over so many decades below the largest value; 0 = evenly."""


def _direction(scene: Scene) -> Array:
    return scene.motion.last_direction


SMOOTH_TERMS = {
    "run_time": SmoothTerm("s", lambda s: s.time_s),
    "run_time_by_direction": SmoothTerm("s", lambda s: s.time_s, factor=_direction),
    "position": SmoothTerm("m", lambda s: s.motion.position_m),
    "position_by_direction": SmoothTerm("m", lambda s: s.motion.position_m, factor=_direction),
    "velocity": SmoothTerm("m/s", lambda s: s.motion.velocity_m_s),
    "speed_by_direction": SmoothTerm(
        "m/s", lambda s: np.abs(s.motion.velocity_m_s), factor=_direction, decades=3.0
    ),
    "run_time_of_the_mass": SmoothTerm("s", lambda s: s.time_s, factor=lambda s: s.motion.acceleration_m_s2),
    "acceleration": SmoothTerm("m/s^2", lambda s: s.motion.acceleration_m_s2),
    "force": SmoothTerm("N", lambda s: s.model_force_n),
    "distance_since_reversal": SmoothTerm(
        "m", lambda s: s.motion.since_reversal_m, factor=_direction, decades=5.0
    ),
}
"""By the name of what they run over."""


def splines(values: Array, lowest: float, highest: float, knots: int = KNOTS) -> Array:
    """Triangular splines (n, knots) between two bounds, held beyond them; they add up to 1."""
    place = np.clip((values - lowest) / max(highest - lowest, 1e-300), 0.0, 1.0) * (knots - 1)
    return np.maximum(1.0 - np.abs(place[:, None] - np.arange(knots)), 0.0)


def knots_of(term: SmoothTerm, shape: Shape) -> Array:
    """Where the splines stand, in the coordinate's unit."""
    low, high = shape
    return np.geomspace(low, high, KNOTS) if term.decades else np.linspace(low, high, KNOTS)


class Splines:
    """One of them as a term that can be tried."""

    def __init__(self, coordinate: str) -> None:
        self.coordinate = coordinate
        self.term = SMOOTH_TERMS[coordinate]

    def shapes(self, scenes: Sequence[Scene]) -> list[Shape]:
        """Where the splines begin and end, for all the recordings alike."""
        values = np.concatenate([self.term.coordinate(scene) for scene in scenes])
        low, high = (float(v) for v in np.percentile(values, [1.0, 99.0]))
        if self.term.decades:
            high = max(float(values.max()), 1e-12)
            low = high * 10.0**-self.term.decades
        return [(low, high)]

    def columns(self, scene: Scene, shape: Shape) -> Array:
        """Splines over the coordinate, (n, KNOTS), less their mean: a constant has a name."""
        term, values, (low, high) = self.term, self.term.coordinate(scene), shape
        if term.decades:
            values, low, high = np.log(np.maximum(values, 1e-300)), math.log(low), math.log(high)
        found = splines(values, low, high) - 1.0 / KNOTS
        return found if term.factor is None else term.factor(scene)[:, None] * found

    def parameters(self, shape: Shape, coefficients: Array) -> dict[str, Parameter]:
        """Height over the coordinate, from the mean of the knots, and where the knots stand; SI."""
        found = {}
        heights = coefficients - coefficients.mean()
        for number, (place, height) in enumerate(zip(knots_of(self.term, shape), heights, strict=True), 1):
            found[f"at_{number}"] = Parameter(float(place), self.term.unit)
            found[f"height_{number}"] = Parameter(float(height), "")
        return found

    def sentence(self, p: dict[str, float]) -> str:
        """Where to look."""
        heights = [value for key, value in p.items() if key.startswith("height")]
        places = [value for key, value in p.items() if key.startswith("at")]
        most = max(range(len(heights)), key=lambda k: abs(heights[k]))
        return (
            "something real that no entry of the catalogue explains: it changes with "
            f"{self.coordinate.replace('_', ' ')}, most at {places[most]:.4g} {self.term.unit}, "
            f"and spans {max(heights) - min(heights):.3g} (SI)"
        )
