"""How well an axis came through its reversals: the indicators of Feng et al. 2015, sections 2 and 5.

A reversal is the sample t1 at which the increment of the position command changes its sign. All
indicators are taken over the monitoring time Tm from t1 on. e = position command - scale position.
Arrays are (n,) per axis, metres, at the SYNC period.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Indices = NDArray[np.int64]


REST_M = 1e-12
"""A smaller increment of the position command is rest, here as in the control law."""


class Indicators(NamedTuple):
    """One reversal of one axis; metres, all of them non-negative."""

    reversal: int
    """Index of the sample t1."""
    direction: int
    """Of the motion after the reversal: +1 or -1."""
    contour_peak_m: float
    error_peak_m: float
    error_rms_m: float
    error_mean_m: float
    """Mean |e|, which is the evaluation J as well."""


class Circle(NamedTuple):
    """A circle in the plane of two axes, metres."""

    centre_m: tuple[float, float]
    radius_m: float


def reversals(position_command_m: Array) -> Indices:
    """Indices of the first samples of each new direction; rests in between do not count."""
    step_m = np.diff(position_command_m)
    direction = np.where(np.abs(step_m) < REST_M, 0.0, np.sign(step_m))
    moving = np.flatnonzero(direction)
    turns = np.flatnonzero(np.diff(direction[moving])) + 1
    return (moving[turns] + 1).astype(np.int64)


def window_samples(window_s: float, period_s: float) -> int:
    """N, the samples in the monitoring time; at least one."""
    return max(round(window_s / period_s), 1)


def evaluation_m(error_m: Array) -> float:
    """The evaluation J = mean |e| over the samples given (chosen: the mean absolute value), metres."""
    return float(np.mean(np.abs(error_m)))


def indicators(
    position_command_m: Array, scale_position_m: Array, contour_error_m: Array, window: int
) -> list[Indicators]:
    """One entry for each reversal whose `window` samples are all there.

    `contour_error_m` comes from `circle_deviation` or `path_deviation`. Samples that are not finite
    make the indicators of their window NaN.
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


def combined(several: list[Indicators]) -> Indicators:
    """Several reversals as one, as if their windows were one: peaks, RMS and mean of all their samples.

    Raises ValueError for none. `reversal` and `direction` are those of the first.
    """
    if not several:
        raise ValueError("there is no reversal to combine")
    table = np.array([tuple(entry)[2:] for entry in several])
    return Indicators(
        several[0].reversal,
        several[0].direction,
        float(table[:, 0].max()),
        float(table[:, 1].max()),
        float(np.sqrt(np.mean(table[:, 2] ** 2))),
        float(table[:, 3].mean()),
    )


def commanded_circle(x_m: Array, y_m: Array) -> Circle:
    """The circle through commanded positions: x^2 + y^2 = 2 a x + 2 b y + c, by least squares.

    Raises ValueError for fewer than three samples or samples on a line.
    """
    x0, y0 = float(np.mean(x_m)), float(np.mean(y_m))
    x, y = x_m - x0, y_m - y0
    matrix = np.column_stack((2.0 * x, 2.0 * y, np.ones_like(x)))
    # columns of like size, so that the rank means something in metres
    unit = float(np.hypot(x, y).max(initial=0.0)) or 1.0
    scale = np.array([unit, unit, 1.0])
    solution, _, rank, _ = np.linalg.lstsq(matrix / scale, x**2 + y**2, rcond=1e-9)
    if rank < 3:
        raise ValueError("the commanded positions are on no circle")
    a, b, c = (float(value) for value in solution / scale)
    return Circle((x0 + a, y0 + b), float(np.sqrt(c + a**2 + b**2)))


def circle_deviation(circle: Circle, x_m: Array, y_m: Array) -> Array:
    """Radial deviation of measured positions, outwards positive, (n,)."""
    return np.hypot(x_m - circle.centre_m[0], y_m - circle.centre_m[1]) - circle.radius_m


def path_deviation(command_m: Array, actual_m: Array) -> Array:
    """Distance of `actual_m` (n, 2) from any commanded path (n, 2), normal to it, left positive, (n,).

    To first order: the error's part across the direction of the command. Where the command rests,
    its last direction holds, before the first motion its first. On a path of radius R the order
    that is left out is e^2 / 2R. Without any motion the deviation is the length of the error.
    """
    error_m = actual_m - command_m
    step_m = np.diff(command_m, axis=0, prepend=command_m[:1])
    length_m = np.hypot(step_m[:, 0], step_m[:, 1])
    moving = np.flatnonzero(length_m)
    if not len(moving):
        return np.hypot(error_m[:, 0], error_m[:, 1])
    latest = np.maximum.accumulate(np.where(length_m > 0.0, np.arange(len(length_m)), moving[0]))
    tangent = step_m[latest] / length_m[latest, np.newaxis]
    return tangent[:, 0] * error_m[:, 1] - tangent[:, 1] * error_m[:, 0]
