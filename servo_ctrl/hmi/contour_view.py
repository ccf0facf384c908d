"""The contour error drawn as a ballbar does, live: about the circle, magnified, and quadrant by quadrant.

What `telemetry.plots.draw_contour` draws for a file, as arrays and ECharts options for a chart.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from servo_ctrl.hmi.contour_turns import AFTER_RAD, BEFORE_RAD, LABELS, QUADRANTS, since_reversal
from servo_ctrl.hmi.palette import GRID_DARK, GRID_LIGHT, INK_DARK, INK_LIGHT, lines
from servo_ctrl.telemetry.contour_traces import round_division
from servo_ctrl.telemetry.min_max import thinned

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from servo_ctrl.hmi.contour_turns import Kind, Turn
    from servo_ctrl.hmi.units import Units
    from servo_ctrl.telemetry.contour_traces import ContourTrace

    Array = NDArray[np.float64]

POLAR_BUCKETS, QUADRANT_BUCKETS = 720, 150
ROUNDING = 1e-9
DIVISIONS = 4.0
"""The radius of the circle as it is drawn, where the magnification is chosen by the error."""
COLOUR_OF: dict[Kind, int] = {"without": 1, "pulse": 0, "observer": 2, "both": 3}
DASHES = {"without": "solid", "pulse": "solid", "observer": "dashed", "both": "dotted"}


class Magnified(NamedTuple):
    """How the error is drawn."""

    factor: float
    division_m: float
    """Between two rings."""


def magnified(traces: Sequence[ContourTrace], radius_m: float, factor: float) -> Magnified:
    """`factor` 0: as much as the largest error allows, its half being a division at most."""
    if factor > 0.0:
        return Magnified(factor, round_division(2.0 * radius_m / DIVISIONS / factor * (1.0 - ROUNDING)))
    largest_m = max((float(np.abs(trace.radial_error_m).max()) for trace in traces), default=0.0)
    division_m = round_division(largest_m)
    return Magnified(radius_m / (DIVISIONS * division_m), division_m)


def polar_points(trace: ContourTrace, turn: Turn, factor: float) -> Array:
    """Points (2, n) of the magnified error about the commanded circle, closed; metres as drawn."""
    angle, error_m = thinned(trace.angle_rad, trace.radial_error_m, POLAR_BUCKETS)
    angle, error_m = np.append(angle, angle[:1]), np.append(error_m, error_m[:1])
    radius_m = turn.circle.radius_m + factor * error_m
    return np.vstack((radius_m * np.cos(angle), radius_m * np.sin(angle)))


def quadrant_points(trace: ContourTrace, place: int) -> Array:
    """Angle since the reversal in degrees and radial error, (2, n), of one quadrant."""
    relative = since_reversal(trace.angle_rad, place)
    inside = np.flatnonzero((relative >= -BEFORE_RAD) & (relative <= AFTER_RAD))
    inside = inside[np.argsort(relative[inside], kind="stable")]
    angle, error_m = thinned(relative[inside], trace.radial_error_m[inside], QUADRANT_BUCKETS)
    return np.vstack((np.degrees(angle), error_m))


def joined(parts: Sequence[Array]) -> tuple[bytes, int]:
    """Arrays (2, n) of different lengths as one payload of arrays of one length; NaN is not drawn."""
    longest = max((part.shape[1] for part in parts), default=0)
    padded = np.full((2 * len(parts), longest), np.nan)
    for k, part in enumerate(parts):
        padded[2 * k : 2 * k + 2, : part.shape[1]] = part
    return bytes(padded.tobytes()), longest


def polar_options(
    kinds: Sequence[Kind], radius_m: float, shown: Magnified, *, dark: bool
) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """The rings and the traces; what is drawn outside of the circle is an error outwards."""
    outside_m = radius_m + 2.5 * shown.factor * shown.division_m
    options = _base(dark=dark)
    limits = {"type": "value", "show": False, "min": -outside_m, "max": outside_m}
    options |= {"grid": {"left": 22, "right": 22, "top": 36, "bottom": 8}, "xAxis": limits, "yAxis": limits}
    grid = GRID_DARK if dark else GRID_LIGHT
    options["series"] = [
        _ring(radius_m + k * shown.factor * shown.division_m, grid, 2 if k == 0 else 1)
        for k in (-2, -1, 0, 1, 2)
    ]
    reach = outside_m * 0.97
    for x, y in ((reach, 0.0), (0.0, reach)):
        options["series"].append(_line([[-x, -y], [x, y]], grid, 1))
    ink = INK_DARK if dark else INK_LIGHT
    options["series"].append(
        {
            "type": "scatter",
            "symbolSize": 0,
            "silent": True,
            "data": [
                {
                    "value": [reach * math.cos(k * math.pi / 2), reach * math.sin(k * math.pi / 2)],
                    "name": name,
                }
                for k, name in enumerate(QUADRANTS)
            ],
            "label": {"show": True, "formatter": "{b}", "color": ink, "position": "inside"},
        }
    )
    series, drawn = _traces(kinds, 0, 1.0, 1.0, dark=dark)
    options["series"] += series
    options["legend"]["data"] = [LABELS[kind] for kind in kinds]
    return options, drawn


def quadrant_options(
    kinds: Sequence[Kind], range_shown: tuple[float, float], units: Units, *, dark: bool
) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Four panes: the radial error over the angle since each reversal."""
    options = _base(dark=dark)
    ink, grid_line = (INK_DARK, GRID_DARK) if dark else (INK_LIGHT, GRID_LIGHT)
    axis = {
        "type": "value",
        "axisLabel": {"color": ink, "hideOverlap": True},
        "splitLine": {"lineStyle": {"color": grid_line}},
    }
    options |= {"grid": [], "xAxis": [], "yAxis": [], "series": []}
    drawn = []
    for place, name in enumerate(QUADRANTS):
        left, top = ("9%", "57%")[place % 2], ("9%", "56%")[place // 2]
        options["grid"].append({"left": left, "top": top, "width": "40%", "height": "36%"})
        below = {"name": f"\N{DEGREE SIGN} behind {name}", "nameLocation": "middle", "nameGap": 22}
        begin, end = -math.degrees(BEFORE_RAD), math.degrees(AFTER_RAD)
        options["xAxis"].append(
            axis | below | {"gridIndex": place, "min": begin, "max": end, "nameTextStyle": {"color": ink}}
        )
        beside = {"min": range_shown[0], "max": range_shown[1], "nameTextStyle": {"color": ink}}
        beside |= {
            "name": units.error.unit if place % 2 == 0 else "",
            "nameLocation": "middle",
            "nameGap": 38,
        }
        options["yAxis"].append(axis | beside | {"gridIndex": place})
        series, traces = _traces(kinds, place, 1.0, units.error.factor, dark=dark)
        options["series"] += series
        drawn += traces
    options["legend"]["data"] = [LABELS[kind] for kind in kinds]
    return options, drawn


def path_options(
    names: tuple[str, str], centre: tuple[float, float], reach_m: float, units: Units, *, dark: bool
) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Command and table in the plane; the chart is square, so that a circle is round."""
    options = _base(dark=dark)
    ink, grid_line = (INK_DARK, GRID_DARK) if dark else (INK_LIGHT, GRID_LIGHT)
    factor, axes = units.length.factor, []
    for name, middle, gap in zip(names, centre, (24, 46), strict=True):
        axes.append(
            {
                "type": "value",
                "min": (middle - reach_m) * factor,
                "max": (middle + reach_m) * factor,
                "name": f"{name} ({units.length.unit})",
                "nameLocation": "middle",
                "nameGap": gap,
                "nameTextStyle": {"color": ink},
                "axisLabel": {
                    "color": ink,
                    "hideOverlap": True,
                    "showMinLabel": False,
                    "showMaxLabel": False,
                },
                "splitLine": {"lineStyle": {"color": grid_line}},
            }
        )
    options |= {
        "grid": {"left": 64, "right": 20, "top": 34, "bottom": 50},
        "xAxis": axes[0],
        "yAxis": axes[1],
    }
    colours = lines(dark=dark)
    drawn = []
    for k, (label, colour, width) in enumerate((("command", ink, 1.0), ("table", colours[0], 1.6))):
        options["series"].append(_series(label, label, colour, width, 0))
        drawn.append({"id": label, "x": 2 * k, "y": 2 * k + 1, "fx": factor, "fy": factor})
    options["legend"]["data"] = ["command", "table"]
    return options, drawn


def _base(*, dark: bool) -> dict[str, Any]:
    ink = INK_DARK if dark else INK_LIGHT
    legend = {"top": 0, "textStyle": {"color": ink}, "selectedMode": False, "type": "scroll", "data": []}
    legend |= {"itemWidth": 34, "itemStyle": {"opacity": 0}}  # a line that is long enough to be dashed
    return {"animation": False, "legend": legend, "series": []}


def _traces(
    kinds: Sequence[Kind], pane: int, fx: float, fy: float, *, dark: bool
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """One series for each kind; its arrays are those of `joined` in panes of as many kinds."""
    series, drawn = [], []
    for k, kind in enumerate(kinds):
        name = f"{kind} {pane}"
        entry = _series(name, LABELS[kind], lines(dark=dark)[COLOUR_OF[kind]], 1.6, pane)
        entry["lineStyle"]["type"] = DASHES[kind]
        series.append(entry)
        place = 2 * (pane * len(kinds) + k)
        drawn.append({"id": name, "x": place, "y": place + 1, "fx": fx, "fy": fy})
    return series, drawn


def _series(name: str, label: str, colour: str, width: float, pane: int) -> dict[str, Any]:
    return {
        "id": name,
        "name": label,
        "type": "line",
        "xAxisIndex": pane,
        "yAxisIndex": pane,
        "symbol": "none",  # nor in the legend
        "silent": True,
        "color": colour,
        "lineStyle": {"width": width},
        "data": [],
    }


def _ring(radius_m: float, colour: str, width: float) -> dict[str, Any]:
    angle = np.linspace(0.0, 2.0 * np.pi, 121)
    return _line(
        np.column_stack((radius_m * np.cos(angle), radius_m * np.sin(angle))).tolist(), colour, width
    )


def _line(points: list[list[float]], colour: str, width: float) -> dict[str, Any]:
    return {
        "type": "line",
        "showSymbol": False,
        "silent": True,
        "color": colour,
        "lineStyle": {"width": width},
        "data": points,
    }
