"""The charts of the Contour page: ECharts options and points of the path, the polar plot and the quadrants.

The polar plot and the quadrants are those that `plots.contour` draws of a recording.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.hmi.charts.echarts import Options, Trace, chart_options, line_series, trace, value_axis
from servo_ctrl.hmi.contour.turns import (
    AFTER_RAD,
    BEFORE_RAD,
    LABELS,
    QUADRANTS,
    Compensation,
    MeasuredTurn,
    since_reversal,
)
from servo_ctrl.hmi.languages.texts import tr
from servo_ctrl.hmi.shell.plots import Look, Theme
from servo_ctrl.plots.contour_traces import ContourTrace, round_division
from servo_ctrl.recording.min_max import thinned

POLAR_BUCKETS, QUADRANT_BUCKETS = 720, 150
"""Bound the buckets of a trace, each drawn as two points; chosen: about one bucket for two pixels."""
ROUNDING = 1e-9
"""Relative error that keeps a round division from being rounded up to the next; chosen."""
DIVISIONS_PER_RADIUS = 4.0
"""Divisions of the error between the centre and the commanded circle; chosen."""
CURVE_OF: dict[Compensation, int] = {"without": 1, "pulse": 0, "observer": 2, "both": 3}
"""Number of the colour, the same as in the plots of recordings."""
DASH_OF: dict[Compensation, str] = {
    "without": "solid",
    "pulse": "solid",
    "observer": "dashed",
    "both": "dotted",
}
LEGEND_LINE_PX = 34
"""Length of a line in the legend, pixels; chosen: a dash must be visible."""


class Magnification(NamedTuple):
    """How many times the error is drawn, and the error between two rings."""

    factor: float
    division_m: float


def magnification(traces: Sequence[ContourTrace], radius_m: float, factor: float) -> Magnification:
    """Return the magnification by `factor`; 0: such that the largest error takes one to two divisions."""
    if factor > 0.0:
        division_m = 2.0 * radius_m / DIVISIONS_PER_RADIUS / factor * (1.0 - ROUNDING)
        return Magnification(factor, round_division(division_m))
    largest_m = max((float(np.abs(trace.radial_error_m).max()) for trace in traces), default=0.0)
    division_m = round_division(largest_m)
    return Magnification(radius_m / (DIVISIONS_PER_RADIUS * division_m), division_m)


def polar_points(trace: ContourTrace, turn: MeasuredTurn, factor: float) -> Array:
    """Return points (2, n) of the magnified error about the commanded circle, closed; metres as drawn."""
    angle, error_m = thinned(trace.angle_rad, trace.radial_error_m, POLAR_BUCKETS)
    angle, error_m = np.append(angle, angle[:1]), np.append(error_m, error_m[:1])
    radius_m = turn.circle.radius_m + factor * error_m
    return np.vstack((radius_m * np.cos(angle), radius_m * np.sin(angle)))


def quadrant_points(trace: ContourTrace, number: int) -> Array:
    """Return the angle since reversal `number` in degrees and the radial error in metres, (2, n)."""
    relative = since_reversal(trace.angle_rad, number)
    inside = np.flatnonzero((relative >= -BEFORE_RAD) & (relative <= AFTER_RAD))
    inside = inside[np.argsort(relative[inside], kind="stable")]
    angle, error_m = thinned(relative[inside], trace.radial_error_m[inside], QUADRANT_BUCKETS)
    return np.vstack((np.degrees(angle), error_m))


def joined(parts: Sequence[Array]) -> tuple[bytes, int]:
    """Join arrays (2, n) into the payload of one frame, padded with NaN; return it and its points."""
    longest = max((part.shape[1] for part in parts), default=0)
    padded = np.full((2 * len(parts), longest), np.nan)
    for k, part in enumerate(parts):
        padded[2 * k : 2 * k + 2, : part.shape[1]] = part
    return bytes(padded.tobytes()), longest


def polar_options(
    kinds: Sequence[Compensation], radius_m: float, shown: Magnification, theme: Theme
) -> tuple[Options, list[Trace]]:
    """Return the rings and one trace for each compensation; outward errors are drawn outside the circle."""
    step_m = shown.factor * shown.division_m
    outside_m = radius_m + 2.5 * step_m
    options = _turn_options(theme, kinds)
    limits = {"type": "value", "show": False, "min": -outside_m, "max": outside_m}
    options |= {"grid": {"left": 22, "right": 22, "top": 36, "bottom": 8}, "xAxis": limits, "yAxis": limits}
    angle = np.linspace(0.0, 2.0 * np.pi, 121)
    ring = np.column_stack((np.cos(angle), np.sin(angle)))
    for k in (-2, -1, 0, 1, 2):
        points = ((radius_m + k * step_m) * ring).tolist()
        options["series"].append(_grid_line(points, theme, 2 if k == 0 else 1))
    reach_m = outside_m * 0.97
    for x_m, y_m in ((reach_m, 0.0), (0.0, reach_m)):
        options["series"].append(_grid_line([[-x_m, -y_m], [x_m, y_m]], theme, 1))
    names = [
        {"name": name, "value": [reach_m * math.cos(k * math.pi / 2), reach_m * math.sin(k * math.pi / 2)]}
        for k, name in enumerate(QUADRANTS)
    ]
    label = {"show": True, "formatter": "{b}", "color": theme.ink, "position": "inside"}
    options["series"].append(
        {"type": "scatter", "symbolSize": 0, "silent": True, "data": names, "label": label}
    )
    series, traces = _turn_series(kinds, 0, 1.0, theme)
    options["series"] += series
    return options, traces


def quadrant_options(
    kinds: Sequence[Compensation], error_range: tuple[float, float], look: Look
) -> tuple[Options, list[Trace]]:
    """Return four panes with the radial error over the angle since each reversal; `error_range` as shown."""
    units, theme = look
    options = _turn_options(theme, kinds) | {"grid": [], "xAxis": [], "yAxis": []}
    traces = []
    for k, name in enumerate(QUADRANTS):
        left, top = ("9%", "57%")[k % 2], ("9%", "56%")[k // 2]
        options["grid"].append({"left": left, "top": top, "width": "40%", "height": "36%"})
        below = value_axis(theme, tr("° after {place}", place=name), 22, gridIndex=k)
        beside = value_axis(theme, units.error.unit if k % 2 == 0 else "", 38, gridIndex=k)
        begin, end = -math.degrees(BEFORE_RAD), math.degrees(AFTER_RAD)
        options["xAxis"].append(below | {"min": begin, "max": end})
        options["yAxis"].append(beside | {"min": error_range[0], "max": error_range[1]})
        series, drawn = _turn_series(kinds, k, units.error.factor, theme)
        options["series"] += series
        traces += drawn
    return options, traces


def path_options(
    axes: Sequence[str], centre_m: Sequence[float], reach_m: float, look: Look
) -> tuple[Options, list[Trace]]:
    """Return the commanded and the actual path; the chart is square, so that a circle is round."""
    units, theme = look
    factor = units.length.factor
    shown: list[dict[str, Any]] = []
    for axis, middle_m, gap in zip(axes, centre_m, (24, 46), strict=True):
        limits = {"min": (middle_m - reach_m) * factor, "max": (middle_m + reach_m) * factor}
        shown.append(value_axis(theme, f"{axis} ({units.length.unit})", gap, **limits))
        shown[-1]["axisLabel"] |= {"showMinLabel": False, "showMaxLabel": False}
    curves = {tr("command"): (theme.ink, 1.0), tr("table"): (theme.curve(0), 1.6)}
    options = chart_options(theme, list(curves), itemWidth=LEGEND_LINE_PX)
    options |= {
        "grid": {"left": 64, "right": 20, "top": 34, "bottom": 50},
        "xAxis": shown[0],
        "yAxis": shown[1],
        "series": [line_series(name, name, *style) for name, style in curves.items()],
    }
    traces = [trace(name, 2 * k, 2 * k + 1, (factor, factor)) for k, name in enumerate(curves)]
    return options, traces


def _turn_options(theme: Theme, kinds: Sequence[Compensation]) -> Options:
    return chart_options(theme, [tr(LABELS[kind]) for kind in kinds], itemWidth=LEGEND_LINE_PX)


def _turn_series(
    kinds: Sequence[Compensation], pane: int, error_factor: float, theme: Theme
) -> tuple[list[Options], list[Trace]]:
    """Return one series and trace for each compensation; their arrays are those of `joined`, pane by pane."""
    series, traces = [], []
    for k, kind in enumerate(kinds):
        name, colour, place = f"{kind} {pane}", theme.curve(CURVE_OF[kind]), 2 * (pane * len(kinds) + k)
        series.append(line_series(name, tr(LABELS[kind]), colour, 1.6, pane=(pane, pane), dash=DASH_OF[kind]))
        traces.append(trace(name, place, place + 1, (1.0, error_factor)))
    return series, traces


def _grid_line(points: list[list[float]], theme: Theme, width: float) -> Options:
    style = {"color": theme.grid, "lineStyle": {"width": width}}
    return {"type": "line", "showSymbol": False, "silent": True, **style, "data": points}
