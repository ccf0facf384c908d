"""Smooth terms: curves over one coordinate, for physics that no entry describes.

Each is a linear spline, even or odd in the direction of motion. They model most of the `unknown` effects.
"""

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.kinds import (
    IN_A_RECORDING,
    OWN,
    SHARED,
    RegressionData,
    ShapeParameters,
    SiParameter,
    UnnamedTerm,
)
from reconcile.catalogue.table_of_knots import TABLES, WITH_MEAN, place_in_knots, tables_of

COARSE_KNOTS, KNOTS = 9, (9, 17, 33)
"""Numbers of knots to try, for slow and for fast changes over the range. A plant's table holds 33."""
AT_A_PLACE = 2.0
"""Fourth shape parameter of a curve that is zero beyond its knots."""
PREFIX = "unknown:"
"""Prefix of the effect of an unnamed term; its coordinate follows."""


class SplineCoordinate(NamedTuple):
    """A coordinate, and the knots of the splines over it."""

    unit: str
    values: Callable[[RegressionData], Array]
    """(n,)"""
    factor: Callable[[RegressionData], Array] | None = None
    """(n,) factor on the splines: the direction of motion, the acceleration."""
    decades: float = 0.0
    """Decades below the largest value over which the knots are spaced logarithmically; 0 = evenly."""
    knots: tuple[int, ...] = (COARSE_KNOTS,)
    """Numbers of knots to try."""
    per_recording: bool = False
    """Each recording has its own curve, with a mean."""


def _direction(data: RegressionData) -> Array:
    return data.motion.last_direction


def _velocity(data: RegressionData) -> Array:
    return data.motion.velocity_m_s


def _acceleration(data: RegressionData) -> Array:
    return data.motion.acceleration_m_s2


QUANTITIES = {
    "": None,
    "_by_direction": _direction,
    "_of_the_damping": _velocity,
    "_of_the_mass": _acceleration,
}
"""Quantities that may change with position and time, by the factor on the splines: force (none), friction,
damping and mass."""
COORDINATES = {
    **{
        f"run_time{end}{one}": SplineCoordinate(
            "s", lambda data: data.time_s, of, knots=KNOTS, per_recording=bool(one)
        )
        for one in ("", IN_A_RECORDING)
        for end, of in QUANTITIES.items()
    },
    **{
        f"position{end}": SplineCoordinate("m", lambda data: data.motion.position_m, of, knots=KNOTS)
        for end, of in QUANTITIES.items()
    },
    "velocity": SplineCoordinate("m/s", lambda data: data.motion.velocity_m_s),
    "speed_by_direction": SplineCoordinate(
        "m/s", lambda data: np.abs(data.motion.velocity_m_s), factor=_direction, decades=3.0
    ),
    "acceleration": SplineCoordinate("m/s^2", lambda data: data.motion.acceleration_m_s2),
    "force": SplineCoordinate("N", lambda data: data.model_force_n),
    "distance_since_reversal": SplineCoordinate(
        "m", lambda data: data.motion.distance_since_reversal_m, factor=_direction, decades=5.0
    ),
}


def _columns(over: SplineCoordinate, data: RegressionData, shape: ShapeParameters) -> Array:
    """Return the rise of a linear spline from each knot to the next (n, knots - 1), held beyond the knots.

    Coefficients are rises, so that the ridge on them keeps a curve level over knots with little excitation.
    The mean over the knots is subtracted, because constant_force has it. Shape parameters: the first knot,
    the last one and their number. A fourth one is WITH_MEAN for a plant's table and for a curve of one
    recording, whose first column is the first height; with AT_A_PLACE the curve is zero at both ends and
    beyond, and the columns are the triangles in between.
    """
    values, low, high, count = over.values(data), shape[0], shape[1], int(shape[2])
    if over.decades:
        values, low, high = np.log(np.maximum(values, 1e-300)), math.log(low), math.log(high)
    place = place_in_knots(values, low, high, count)
    if AT_A_PLACE in shape[3:]:
        found: Array = np.maximum(1.0 - np.abs(place[:, None] - np.arange(1, count - 1)), 0.0)
        return found if over.factor is None else found * over.factor(data)[:, None]
    found = place[:, None] - np.arange(count - 1)
    np.clip(found, 0.0, 1.0, out=found)  # in place: of a long recording each copy takes a hundred megabytes
    if WITH_MEAN in shape[3:]:
        found = np.concatenate((np.ones((len(place), 1)), found), axis=1)
    else:
        found -= 1.0 - np.arange(1, count) / count
    if over.factor is not None:
        found *= over.factor(data)[:, None]
    return found


def _heights(shape: ShapeParameters, coefficients: Array) -> Array:
    """Return the heights of the knots; without WITH_MEAN and AT_A_PLACE, above their mean."""
    if AT_A_PLACE in shape[3:]:
        return np.concatenate(([0.0], coefficients, [0.0]))
    if WITH_MEAN in shape[3:]:
        return np.cumsum(coefficients)
    heights = np.cumsum(np.append(0.0, coefficients))
    found: Array = heights - heights.mean()
    return found


def _splines(name: str, over: SplineCoordinate) -> UnnamedTerm:
    def knots(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
        values = np.concatenate([over.values(data) for data in datasets])
        low, high = (float(v) for v in np.percentile(values, [1.0, 99.0]))
        if over.decades:
            high = max(float(values.max()), 1e-12)
            low = high * 10.0**-over.decades
        if over.per_recording:
            return [(low, high, float(k), WITH_MEAN) for k in over.knots] if len(datasets) > 1 else []
        return [(low, high, float(k)) for k in over.knots]

    def parameters(shape: ShapeParameters, coefficients: Array) -> dict[str, SiParameter]:
        """Knots and heights above their mean, SI."""
        found, (low, high, count) = {}, shape[:3]
        places = (np.geomspace if over.decades else np.linspace)(low, high, int(count))
        heights = _heights(shape, coefficients)
        for number, (place, height) in enumerate(zip(places, heights, strict=True), 1):
            found[f"at_{number}"] = SiParameter(float(place), over.unit)
            found[f"height_{number}"] = SiParameter(float(height), "")
        return found

    def finding(p: dict[str, float]) -> str:
        heights = [value for key, value in p.items() if key.startswith("height")]
        places = [value for key, value in p.items() if key.startswith("at")]
        most = max(range(len(heights)), key=lambda k: abs(heights[k]))
        return (
            f"it changes with {name.replace('_', ' ')}, most at {places[most]:.4g} {over.unit}, and spans "
            f"{max(heights) - min(heights):.3g} (SI)"
        )

    unnamed = UnnamedTerm(
        knots,
        partial(_columns, over),
        parameters,
        finding,
        per_recording=OWN if over.per_recording else SHARED,
    )
    table = TABLES.get(name)
    return unnamed._replace(section=table.section, to_plant=table.to_plant) if table else unnamed


SMOOTH_TERMS = {name: _splines(name, over) for name, over in COORDINATES.items()}
"""Smooth terms by the name of the coordinate."""


def terms_of_tables(of: ModelEffect) -> list[ModelTerm]:
    """Return the smooth terms that equal a plant's tables; none for tables of zeros."""
    terms = [table.from_plant(of, PREFIX + name) for name, table in tables_of(of.effect).items()]
    return [one for one in terms if any(one.coefficients)]
