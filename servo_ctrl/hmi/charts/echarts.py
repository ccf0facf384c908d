"""ECharts options that all live charts share: legend, axes and line series, without data."""

from collections.abc import Sequence
from typing import Any, TypeAlias

from servo_ctrl.hmi.shell.plots import Theme

Options: TypeAlias = "dict[str, Any]"
Trace: TypeAlias = "dict[str, Any]"
"""What `LiveChart` draws as one series: its id, places of x and y among the arrays, and their factors."""


def chart_options(theme: Theme, names: Sequence[str], **legend: Any) -> Options:
    """Return options with a legend of these series and no series yet."""
    marker = {"itemStyle": {"opacity": 0}}  # the line alone: it shows the dash of its series
    text = {"textStyle": {"color": theme.ink}}
    shown = {"top": 0, "type": "scroll", "selectedMode": False, "data": list(names), **text, **marker}
    return {"animation": False, "legend": shown | legend, "series": []}


def value_axis(theme: Theme, name: str, gap: int, **fields: Any) -> Options:
    """Return an axis of numbers with its name beside the middle, `gap` pixels away."""
    return {
        "type": "value",
        "name": name,
        "nameLocation": "middle",
        "nameGap": gap,
        "nameTextStyle": {"color": theme.ink},
        "axisLabel": {"color": theme.ink, "hideOverlap": True},
        "splitLine": {"lineStyle": {"color": theme.grid}},
        **fields,
    }


def line_series(
    identifier: str, name: str, colour: str, width: float, pane: tuple[int, int] = (0, 0), dash: str = "solid"
) -> Options:
    """Return a line without points yet; `pane` are the indices of its x and y axis."""
    return {
        "id": identifier,
        "name": name,
        "type": "line",
        "xAxisIndex": pane[0],
        "yAxisIndex": pane[1],
        "symbol": "none",  # the legend shows no symbol either
        "silent": True,
        "color": colour,
        "lineStyle": {"width": width, "type": dash},
        "data": [],
    }


def trace(identifier: str, x: int, y: int, factors: tuple[float, float], offset: float = 0.0) -> Trace:
    """Draw the series from the arrays at places `x` and `y`, times the factors, y plus the offset."""
    return {"id": identifier, "x": x, "y": y, "fx": factors[0], "fy": factors[1], "oy": offset}
