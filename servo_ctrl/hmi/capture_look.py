"""How the scope looks: channels of one unit share a pane; a fixed scale has an axis of its own."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from servo_ctrl.hmi.palette import (
    GRID_DARK,
    GRID_LIGHT,
    INK_DARK,
    INK_LIGHT,
    ORANGE,
    PURPLE,
    lines,
)
from servo_ctrl.hmi.units import Scale

if TYPE_CHECKING:
    from collections.abc import Sequence

    from servo_ctrl.hmi.units import Units

CHANNELS_AT_MOST = 8
SMALL = ("position_error_m", "correction_m")
"""Lengths that are deviations."""
ABOVE, BELOW, BETWEEN = 9.0, 9.0, 4.0
"""Per cent of the height: legend, time axis, gap of two panes."""
CURSOR_COLOURS = {"A": ORANGE, "B": PURPLE}
_PLAIN = {"s": Scale("s", 1.0, 3), "N": Scale("N", 1.0, 2), "A": Scale("A", 1.0, 3)}


class Trace(NamedTuple):
    """One channel that is shown."""

    name: str
    place: int
    """In a row."""
    scale: Scale
    fixed: tuple[float, float] | None = None
    """Least and greatest value of its axis, in its unit; None: chosen with the others of its pane."""


class Look(NamedTuple):
    """What is drawn beside the traces; times in seconds from where the time is zero."""

    span_s: float
    before_s: float
    """Of the picture before zero."""
    cursors: dict[str, float]
    dark: bool
    level: tuple[str, float] | None = None
    """Of the trigger: channel, and value in its unit."""


def scale_of(name: str, unit: str, units: Units) -> Scale:
    """How a channel is shown."""
    if unit == "m":
        return units.error if name.endswith(SMALL) else units.length
    if unit == "m/s":
        return units.velocity
    return _PLAIN.get(unit, Scale("" if unit == "1" else unit, 1.0, 0))


def time_scale(span_s: float) -> Scale:
    """Of the time axis."""
    return Scale("ms", 1e3, 1) if span_s < 2.0 else Scale("s", 1.0, 4)


def panes_of(traces: Sequence[Trace]) -> list[str]:
    """The units, one pane each, in the order of the channels."""
    return list(dict.fromkeys(trace.scale.unit for trace in traces))


def scope_options(
    traces: Sequence[Trace], look: Look, period_s: float
) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """ECharts options without data, and what `LiveChart` draws of its arrays: row numbers, the traces."""
    ink, grid_line = (INK_DARK, GRID_DARK) if look.dark else (INK_LIGHT, GRID_LIGHT)
    colours, time = lines(dark=look.dark), time_scale(look.span_s)
    panes = panes_of(traces)
    own = [trace for trace in traces if trace.fixed is not None]
    height = (100.0 - ABOVE - BELOW + BETWEEN) / max(len(panes), 1)
    axis: dict[str, Any] = {
        "axisLine": {"show": True, "lineStyle": {"color": grid_line}},
        "axisLabel": {"color": ink, "hideOverlap": True},
        "splitLine": {"lineStyle": {"color": grid_line}},
        "nameTextStyle": {"color": ink},
    }
    begin = -look.before_s * time.factor
    options: dict[str, Any] = {
        "animation": False,
        "legend": {
            "top": 0,
            "textStyle": {"color": ink},
            "type": "scroll",
            "itemStyle": {"opacity": 0},
            "selectedMode": False,
            "data": [],
        },
        "grid": [
            {
                "left": 64,
                "right": 16 + 60 * len(own),
                "top": f"{ABOVE + height * k}%",
                "height": f"{height - BETWEEN}%",
            }
            for k in range(len(panes))
        ],
        "xAxis": [
            axis
            | {
                "type": "value",
                "gridIndex": k,
                "min": begin,
                "max": begin + look.span_s * time.factor,
                "name": f"time ({time.unit})" if k == len(panes) - 1 else "",
                "nameLocation": "middle",
                "nameGap": 24,
                "axisLabel": {**axis["axisLabel"], "show": k == len(panes) - 1},
            }
            for k in range(len(panes))
        ],
        "yAxis": [
            axis
            | {
                "type": "value",
                "gridIndex": k,
                "scale": True,
                "name": unit,
                "nameLocation": "middle",
                "nameGap": 46,
            }
            for k, unit in enumerate(panes)
        ],
        "series": [],
    }
    drawn = []
    for place, trace in enumerate(traces):
        pane = panes.index(trace.scale.unit)
        colour, y_axis = colours[place % len(colours)], pane
        if trace.fixed is not None:
            y_axis = len(options["yAxis"])
            options["yAxis"].append(_own_axis(axis, trace, pane, colour, 60 * own.index(trace)))
        options["legend"]["data"].append(trace.name)
        options["series"].append(
            {
                "id": trace.name,
                "name": trace.name,
                "type": "line",
                "xAxisIndex": pane,
                "yAxisIndex": y_axis,
                "symbol": "none",  # nor in the legend
                "silent": True,
                "lineStyle": {"width": 1.4, "type": "solid" if place < len(colours) else "dashed"},
                "color": colour,
                "data": [],
                "markLine": _marks(look) if look.level and look.level[0] == trace.name else None,
            }
        )
        drawn.append(
            {"id": trace.name, "x": 0, "y": place + 1, "fx": period_s * time.factor, "fy": trace.scale.factor}
        )
    options["series"] += [_cursors(pane, look, time) for pane in range(len(panes))]
    return options, drawn


def _own_axis(axis: dict[str, Any], trace: Trace, pane: int, colour: str, offset: int) -> dict[str, Any]:
    low, high = trace.fixed or (0.0, 1.0)
    return axis | {
        "type": "value",
        "gridIndex": pane,
        "position": "right",
        "offset": offset,
        "min": low,
        "max": high,
        "axisLine": {"show": True, "lineStyle": {"color": colour}},
        "splitLine": {"show": False},
    }


def _marks(look: Look) -> dict[str, Any]:
    """The level of the trigger."""
    value = look.level[1] if look.level else 0.0
    return {
        "silent": True,
        "symbol": "none",
        "label": {"formatter": "level", "position": "insideEndTop"},
        "lineStyle": {"type": "dashed", "width": 1},
        "data": [{"yAxis": value}],
    }


def _cursors(pane: int, look: Look, time: Scale) -> dict[str, Any]:
    """Both cursors in one pane, on a series without points."""
    return {
        "id": f"cursors {pane}",
        "type": "line",
        "xAxisIndex": pane,
        "yAxisIndex": pane,
        "silent": True,
        "data": [],
        "markLine": {
            "silent": True,
            "symbol": "none",
            "data": [
                {
                    "xAxis": at_s * time.factor,
                    "label": {"formatter": name, "show": pane == 0},
                    "lineStyle": {"color": CURSOR_COLOURS[name], "width": 2, "type": "solid"},
                }
                for name, at_s in look.cursors.items()
            ],
        },
    }
