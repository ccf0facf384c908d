"""Indicators of an axis at its reversals (Feng et al. 2015, sections 2 and 5), and deviation from a circle.

A reversal is the sample t1 at which the increment of the position command changes its sign. All
indicators are taken over the monitoring time Tm from t1 on. e = position command - scale position.
Arrays are (n,) per axis, metres, at the SYNC period.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array, rms

Indices = NDArray[np.int64]


REST_M = 1e-12
"""Increments of the position command below this count as standstill, as in the control law (`REST_M`)."""


class Indicators(NamedTuple):
    """One reversal of one axis; metres, none negative."""

    reversal: int
    """Index of the sample t1."""
    direction: int
    """Direction of motion after the reversal: +1 or -1."""
    contour_peak_m: float
    error_peak_m: float
    error_rms_m: float
    error_mean_m: float
    """Mean |e|: the evaluation J."""


class FittedCircle(NamedTuple):
    """A circle in the plane of two axes, metres."""

    centre_m: tuple[float, float]
    radius_m: float


def reversals(position_command_m: Array) -> Indices:
    """Return the indices of the first sample of each new direction; pauses between are skipped."""
    step_m = np.diff(position_command_m)
    direction = np.where(np.abs(step_m) < REST_M, 0.0, np.sign(step_m))
    moving = np.flatnonzero(direction)
    turns = np.flatnonzero(np.diff(direction[moving])) + 1
    return (moving[turns] + 1).astype(np.int64)


def window_samples(window_s: float, period_s: float) -> int:
    """Number of samples in the monitoring time; at least one."""
    return max(round(window_s / period_s), 1)


def evaluation_m(error_m: Array) -> float:
    """Evaluation J: mean |e| over the samples given, metres."""
    return float(np.mean(np.abs(error_m)))


def indicators(
    position_command_m: Array, scale_position_m: Array, contour_error_m: Array, window: int
) -> list[Indicators]:
    """Indicators of each reversal whose `window` samples are complete.

    `contour_error_m` (n,): deviation normal to the path, e.g. `circle_deviation`. A sample that is not finite
    makes the indicators of its window NaN.
    """
    error_m = position_command_m - scale_position_m
    starts = reversals(position_command_m)
    starts = starts[starts + window <= len(error_m)]
    if not len(starts):
        return []
    rows = starts[:, np.newaxis] + np.arange(window)
    errors, contours = np.abs(error_m[rows]), np.abs(contour_error_m[rows])
    direction = np.sign(position_command_m[starts] - position_command_m[starts - 1])
    columns = (
        starts,
        direction.astype(np.int64),
        contours.max(axis=1),
        errors.max(axis=1),
        np.sqrt(np.mean(errors**2, axis=1)),
        errors.mean(axis=1),
    )
    return [Indicators(*row) for row in zip(*(column.tolist() for column in columns), strict=True)]


def combined(reversal_indicators: list[Indicators]) -> Indicators:
    """Pool several reversals: peaks, RMS and mean over the samples of all their windows.

    Raises ValueError for an empty list. `reversal` and `direction` are those of the first.
    """
    if not reversal_indicators:
        raise ValueError("there is no reversal to combine")
    table = np.array([tuple(entry)[2:] for entry in reversal_indicators])
    return Indicators(
        reversal=reversal_indicators[0].reversal,
        direction=reversal_indicators[0].direction,
        contour_peak_m=float(table[:, 0].max()),
        error_peak_m=float(table[:, 1].max()),
        error_rms_m=rms(table[:, 2]),
        error_mean_m=float(table[:, 3].mean()),
    )


def commanded_circle(x_m: Array, y_m: Array) -> FittedCircle:
    """Fit a circle to commanded positions (n,) by least squares of x^2 + y^2 = 2 a x + 2 b y + c.

    Raises ValueError for fewer than three samples or samples on a line.
    """
    x0, y0 = float(np.mean(x_m)), float(np.mean(y_m))
    x, y = x_m - x0, y_m - y0
    matrix = np.column_stack((2.0 * x, 2.0 * y, np.ones_like(x)))
    # columns of similar size, so that the rank does not depend on the unit
    unit = float(np.hypot(x, y).max(initial=0.0)) or 1.0
    scale = np.array([unit, unit, 1.0])
    solution, _, rank, _ = np.linalg.lstsq(matrix / scale, x**2 + y**2, rcond=1e-9)
    if rank < 3:
        raise ValueError("the commanded positions are on no circle")
    a, b, c = (float(value) for value in solution / scale)
    return FittedCircle((x0 + a, y0 + b), float(np.sqrt(c + a**2 + b**2)))


def circle_deviation(circle: FittedCircle, x_m: Array, y_m: Array) -> Array:
    """Radial deviation of measured positions (n,), outwards positive."""
    return np.hypot(x_m - circle.centre_m[0], y_m - circle.centre_m[1]) - circle.radius_m
