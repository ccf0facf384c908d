"""Smooth terms: physics that no entry describes, as a function of the coordinate that it changes with.

Each is a set of triangular splines over one coordinate, even in the direction of motion or odd. They are what
`unknown` is modelled by.
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from reconcile.catalogue.kinds import Parameter, RegressionData, ShapeParameters

KNOTS = 9
PREFIX = "unknown:"
"""Prefix of the candidate terms without a name; the coordinate follows."""


class SmoothTerm(NamedTuple):
    """A coordinate, and how the splines lie over it."""

    unit: str
    coordinate: Callable[[RegressionData], Array]
    """(n,)"""
    factor: Callable[[RegressionData], Array] | None = None
    """(n,) factor on the splines: the direction of motion, the acceleration."""
    decades: float = 0.0
    """Decades below the largest value over which the knots are spaced logarithmically; 0 = evenly."""


def _direction(data: RegressionData) -> Array:
    return data.motion.last_direction


SMOOTH_TERMS = {
    "run_time": SmoothTerm("s", lambda data: data.time_s),
    "run_time_by_direction": SmoothTerm("s", lambda data: data.time_s, factor=_direction),
    "position": SmoothTerm("m", lambda data: data.motion.position_m),
    "position_by_direction": SmoothTerm("m", lambda data: data.motion.position_m, factor=_direction),
    "velocity": SmoothTerm("m/s", lambda data: data.motion.velocity_m_s),
    "speed_by_direction": SmoothTerm(
        "m/s", lambda data: np.abs(data.motion.velocity_m_s), factor=_direction, decades=3.0
    ),
    "run_time_of_the_mass": SmoothTerm(
        "s", lambda data: data.time_s, factor=lambda data: data.motion.acceleration_m_s2
    ),
    "acceleration": SmoothTerm("m/s^2", lambda data: data.motion.acceleration_m_s2),
    "force": SmoothTerm("N", lambda data: data.model_force_n),
    "distance_since_reversal": SmoothTerm(
        "m", lambda data: data.motion.distance_since_reversal_m, factor=_direction, decades=5.0
    ),
}
"""By the name of the coordinate."""


class Splines:
    """A smooth term as a candidate."""

    def __init__(self, coordinate: str) -> None:
        self.coordinate = coordinate
        self.term = SMOOTH_TERMS[coordinate]

    def shapes(self, datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
        """First and last knot, from all the recordings."""
        values = np.concatenate([self.term.coordinate(data) for data in datasets])
        low, high = (float(v) for v in np.percentile(values, [1.0, 99.0]))
        if self.term.decades:
            high = max(float(values.max()), 1e-12)
            low = high * 10.0**-self.term.decades
        return [(low, high)]

    def columns(self, data: RegressionData, shape: ShapeParameters) -> Array:
        """Triangular splines, held beyond the knots, (n, KNOTS), less their mean: constant_force has that."""
        term, values, (low, high) = self.term, self.term.coordinate(data), shape
        if term.decades:
            values, low, high = np.log(np.maximum(values, 1e-300)), math.log(low), math.log(high)
        place = np.clip((values - low) / max(high - low, 1e-300), 0.0, 1.0) * (KNOTS - 1)
        found = np.maximum(1.0 - np.abs(place[:, None] - np.arange(KNOTS)), 0.0) - 1.0 / KNOTS
        return found if term.factor is None else term.factor(data)[:, None] * found

    def parameters(self, shape: ShapeParameters, coefficients: Array) -> dict[str, Parameter]:
        """Knots and heights above their mean, SI."""
        found = {}
        low, high = shape
        knots = np.geomspace(low, high, KNOTS) if self.term.decades else np.linspace(low, high, KNOTS)
        heights = coefficients - coefficients.mean()
        for number, (place, height) in enumerate(zip(knots, heights, strict=True), 1):
            found[f"at_{number}"] = Parameter(float(place), self.term.unit)
            found[f"height_{number}"] = Parameter(float(height), "")
        return found

    def sentence(self, p: dict[str, float]) -> str:
        """Explanation after `EXPLAINED_BY_NOTHING`."""
        heights = [value for key, value in p.items() if key.startswith("height")]
        places = [value for key, value in p.items() if key.startswith("at")]
        most = max(range(len(heights)), key=lambda k: abs(heights[k]))
        return (
            f"it changes with {self.coordinate.replace('_', ' ')}, most at {places[most]:.4g} "
            f"{self.term.unit}, and spans {max(heights) - min(heights):.3g} (SI)"
        )
