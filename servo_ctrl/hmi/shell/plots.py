"""Plotly figures of one look, as dictionaries: `ui.plotly` takes them without importing plotly."""

from collections.abc import Sequence
from typing import Any

from servo_ctrl.hmi.shell.palette import theme_of


def plot_layout(x: str, y: str, *, dark: bool) -> dict[str, Any]:
    """A layout with these axis titles and the legend above the plot."""
    theme = theme_of(dark=dark)
    axis = {"gridcolor": theme.grid, "zerolinecolor": theme.grid, "linecolor": theme.grid, "automargin": True}
    return {
        "paper_bgcolor": theme.background,
        "plot_bgcolor": theme.background,
        "font": {"color": theme.ink, "size": 12},
        "colorway": list(theme.curves),
        "margin": {"l": 48, "r": 12, "t": 12, "b": 40},
        "xaxis": {**axis, "title": {"text": x}},
        "yaxis": {**axis, "title": {"text": y}},
        "showlegend": True,
        "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0},
    }


def curve(
    name: str, x: Sequence[float], y: Sequence[float | None], mode: str = "lines", **fields: Any
) -> dict[str, Any]:
    """A scatter trace; None in `y` is a gap. `fields` are those of plotly, as `line` and `marker`."""
    return {"type": "scatter", "mode": mode, "name": name, "x": x, "y": y, **fields}


def figure(data: list[dict[str, Any]], layout: dict[str, Any], *, revision: str) -> dict[str, Any]:
    """A figure that keeps its zoom while `revision` is the same."""
    config = {"displaylogo": False, "responsive": True, "displayModeBar": False}
    return {"data": data, "layout": {**layout, "uirevision": revision}, "config": config}


def horizontal_line(text: str, y: float, colour: str) -> dict[str, Any]:
    """Layout entries of a dashed line across the plot with a text above its right end."""
    shape = {"type": "line", "xref": "paper", "x0": 0, "x1": 1, "y0": y, "y1": y}
    label = {"text": text, "xref": "paper", "x": 1, "xanchor": "right", "y": y, "yanchor": "bottom"}
    return {
        "shapes": [{**shape, "line": {"color": colour, "dash": "dash", "width": 2}}],
        "annotations": [{**label, "showarrow": False, "font": {"color": colour}}],
    }
