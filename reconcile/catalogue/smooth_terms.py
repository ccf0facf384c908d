"""Smooth terms: physics that no entry describes, as a function of the coordinate that it changes with.

Each is a set of triangular splines over one coordinate, even in the direction of motion or odd. They are what
`unknown` is modelled by.
"""

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.kinds import Parameter, RegressionData, ShapeParameters, UnnamedTerm
from reconcile.catalogue.table_of_knots import TABLES, tables_of

KNOTS = 9
PREFIX = "unknown:"
"""Prefix of the candidate terms without a name; the coordinate follows."""


class SplineCoordinate(NamedTuple):
    """A coordinate, and how the splines lie over it."""

    unit: str
    values: Callable[[RegressionData], Array]
    """(n,)"""
    factor: Callable[[RegressionData], Array] | None = None
    """(n,) factor on the splines: the direction of motion, the acceleration."""
    decades: float = 0.0
    """Decades below the largest value over which the knots are spaced logarithmically; 0 = evenly."""


def _direction(data: RegressionData) -> Array:
    return data.motion.last_direction


COORDINATES = {
    "run_time": SplineCoordinate("s", lambda data: data.time_s),
    "run_time_by_direction": SplineCoordinate("s", lambda data: data.time_s, factor=_direction),
    "position": SplineCoordinate("m", lambda data: data.motion.position_m),
    "position_by_direction": SplineCoordinate("m", lambda data: data.motion.position_m, factor=_direction),
    "velocity": SplineCoordinate("m/s", lambda data: data.motion.velocity_m_s),
    "speed_by_direction": SplineCoordinate(
        "m/s", lambda data: np.abs(data.motion.velocity_m_s), factor=_direction, decades=3.0
    ),
    "run_time_of_the_mass": SplineCoordinate(
        "s", lambda data: data.time_s, factor=lambda data: data.motion.acceleration_m_s2
    ),
    "acceleration": SplineCoordinate("m/s^2", lambda data: data.motion.acceleration_m_s2),
    "force": SplineCoordinate("N", lambda data: data.model_force_n),
    "distance_since_reversal": SplineCoordinate(
        "m", lambda data: data.motion.distance_since_reversal_m, factor=_direction, decades=5.0
    ),
}


def _columns(over: SplineCoordinate, data: RegressionData, shape: ShapeParameters) -> Array:
    """Triangular splines, held beyond the knots, (n, KNOTS), less their mean: constant_force has that.

    A third shape parameter is the number of knots of a plant's table, which has a mean of its own.
    """
    values, low, high = over.values(data), shape[0], shape[1]
    count = int(shape[2]) if len(shape) > 2 else KNOTS
    if over.decades:
        values, low, high = np.log(np.maximum(values, 1e-300)), math.log(low), math.log(high)
    place = np.clip((values - low) / max(high - low, 1e-300), 0.0, 1.0) * (count - 1)
    found: Array = place[:, None] - np.arange(count)
    np.abs(found, out=found)  # in place: of a long recording each copy takes a hundred megabytes
    np.maximum(np.subtract(1.0, found, out=found), 0.0, out=found)
    if len(shape) == 2:
        found -= 1.0 / count
    if over.factor is not None:
        found *= over.factor(data)[:, None]
    return found


def _splines(name: str, over: SplineCoordinate) -> UnnamedTerm:
    def first_and_last_knot(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
        values = np.concatenate([over.values(data) for data in datasets])
        low, high = (float(v) for v in np.percentile(values, [1.0, 99.0]))
        if over.decades:
            high = max(float(values.max()), 1e-12)
            low = high * 10.0**-over.decades
        return [(low, high)]

    def parameters(shape: ShapeParameters, coefficients: Array) -> dict[str, Parameter]:
        """Knots and heights above their mean, SI."""
        found, low, high = {}, shape[0], shape[1]
        knots = np.geomspace(low, high, KNOTS) if over.decades else np.linspace(low, high, KNOTS)
        heights = coefficients - coefficients.mean()
        for number, (place, height) in enumerate(zip(knots, heights, strict=True), 1):
            found[f"at_{number}"] = Parameter(float(place), over.unit)
            found[f"height_{number}"] = Parameter(float(height), "")
        return found

    def finding(p: dict[str, float]) -> str:
        heights = [value for key, value in p.items() if key.startswith("height")]
        places = [value for key, value in p.items() if key.startswith("at")]
        most = max(range(len(heights)), key=lambda k: abs(heights[k]))
        return (
            f"it changes with {name.replace('_', ' ')}, most at {places[most]:.4g} {over.unit}, and spans "
            f"{max(heights) - min(heights):.3g} (SI)"
        )

    if (table := TABLES.get(name)) is None:
        return UnnamedTerm(first_and_last_knot, partial(_columns, over), parameters, finding)
    return UnnamedTerm(
        first_and_last_knot,
        partial(_columns, over),
        parameters,
        finding,
        section=table.section,
        to_plant=table.to_plant,
    )


SMOOTH_TERMS = {name: _splines(name, over) for name, over in COORDINATES.items()}
"""By the name of the coordinate."""


def terms_of_tables(of: ModelEffect) -> list[ModelTerm]:
    """The smooth terms that a plant's tables are; of tables of zeros none."""
    terms = [table.from_plant(of, PREFIX + name) for name, table in tables_of(of.effect).items()]
    return [one for one in terms if any(one.coefficients)]
