"""Evaluates circles on an X-Y table: indicators at the reversals, traces for plots.

Only the part at constant speed counts; start and end of a circle belong to no reversal.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array
from servo_ctrl.learning.performance import (
    FittedCircle,
    Indicators,
    circle_deviation,
    combined,
    commanded_circle,
    indicators,
    reversals,
    window_samples,
)
from servo_ctrl.plots.contour_traces import ContourTrace, ErrorTrace
from servo_ctrl.recording.reader import Recording

AXES = ("x", "y")
SPEED_TOLERANCE = 1e-6
"""Relative tolerance of the constant speed; chosen: one sample of a ramp differs by far more."""
BEFORE_S, AFTER_S = 0.05, 0.15
"""Parts of an error trace before the reversal and after the monitoring time, seconds; chosen."""


class ReversalFigures(NamedTuple):
    """Indicators at the reversals of one axis over the monitoring time, micrometres."""

    contour_peak_um: float
    mean_um: float
    peak_um: float
    rms_um: float


class CircleResult(NamedTuple):
    """Results of one circle at one feed; metres, seconds."""

    label: str
    feed_mm_min: int
    radius_m: float
    indicators: dict[str, Indicators]
    error_traces: dict[str, ErrorTrace]
    contour: ContourTrace


def analyse_circles(recording: Recording, window_s: float) -> list[CircleResult]:
    """Evaluate each circle of a recording in order; `window_s` is the monitoring time Tm.

    Raises:
        ValueError: a circle without a whole turn or a reversal at constant speed.

    """
    labels = [segment["label"] for segment in recording.header["segments"] if segment.get("kind") == "circle"]
    return [_analyse(label, recording.segment(label), window_s) for label in labels]


def _analyse(label: str, columns: dict[str, NDArray[Any]], window_s: float) -> CircleResult:
    time_s = columns["time_s"]
    period_s = float(time_s[1] - time_s[0])
    window = window_samples(window_s, period_s)
    speed_m_s = np.hypot(columns["x.velocity_command_m_s"], columns["y.velocity_command_m_s"])
    feed_m_s = float(np.median(speed_m_s))
    steady = np.flatnonzero(np.abs(speed_m_s - feed_m_s) < SPEED_TOLERANCE * feed_m_s)
    steady_part = slice(int(steady[0]), int(steady[-1]) + 1)
    command = {axis: columns[f"{axis}.position_command_m"][steady_part] for axis in AXES}
    scale = {axis: columns[f"{axis}.scale_position_m"][steady_part] for axis in AXES}
    circle = commanded_circle(command["x"], command["y"])
    deviation_m = circle_deviation(circle, scale["x"], scale["y"])
    of_axis, traces = {}, {}
    for axis in AXES:
        reversal_indicators = indicators(command[axis], scale[axis], deviation_m, window)
        if not reversal_indicators:
            raise ValueError(
                f"{label}: no reversal of {axis} with its whole monitoring time at constant speed"
            )
        of_axis[axis] = combined(reversal_indicators)
        traces[axis] = error_trace(label, command[axis] - scale[axis], command[axis], period_s, window_s)
    return CircleResult(
        label=label,
        feed_mm_min=round(feed_m_s * 60e3),
        radius_m=circle.radius_m,
        indicators=of_axis,
        error_traces=traces,
        contour=last_turn(label, circle, command["x"], command["y"], deviation_m),
    )


def last_turn(label: str, circle: FittedCircle, x_m: Array, y_m: Array, deviation_m: Array) -> ContourTrace:
    """Return the last whole turn, which is the most settled one, by the commanded positions.

    Raises ValueError for less than one turn.
    """
    angle_rad = np.unwrap(np.arctan2(y_m - circle.centre_m[1], x_m - circle.centre_m[0]))
    if abs(angle_rad[-1] - angle_rad[0]) < 2.0 * np.pi:
        raise ValueError(f"{label}: less than one turn at constant speed")
    turn = np.abs(angle_rad - angle_rad[-1]) < 2.0 * np.pi
    return ContourTrace(label, angle_rad[turn], deviation_m[turn])


def error_trace(label: str, error_m: Array, command_m: Array, period_s: float, window_s: float) -> ErrorTrace:
    """Return the error around the last completely recorded reversal, positive when the table lags."""
    before, after = round(BEFORE_S / period_s), round((window_s + AFTER_S) / period_s)
    starts = reversals(command_m)
    complete = starts[(starts >= before) & (starts + after <= len(error_m))]
    if not len(complete):
        raise ValueError(f"{label}: no reversal with {BEFORE_S} s before and {window_s + AFTER_S} s after it")
    start = int(complete[-1])
    steady_part = slice(start - before, start + after)
    direction = 1.0 if command_m[start] > command_m[start - 1] else -1.0
    lag_m = error_m[steady_part] * direction
    return ErrorTrace(label, np.arange(-before, after, dtype=np.float64) * period_s, lag_m)


def figures_um(figures: Indicators) -> ReversalFigures:
    """Return the four indicators in micrometres."""
    return ReversalFigures(
        contour_peak_um=1e6 * figures.contour_peak_m,
        mean_um=1e6 * figures.error_mean_m,
        peak_um=1e6 * figures.error_peak_m,
        rms_um=1e6 * figures.error_rms_m,
    )
