"""Pieces of pictures as plotly.js takes them: series, marks, axes, bands; colours by their role."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from servo_ctrl.report.packed import packed

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

NAMES = {"before": "nominal model", "refitted": "its values refitted", "after": "with what was found"}
DASHES = {"before": "solid", "refitted": "dot", "after": "solid"}
SYMBOLS = {"before": "circle-open", "refitted": "diamond-open", "after": "square"}
LOGARITHMIC = {"type": "log", "dtick": 1, "exponentformat": "none"}


def line(role: str, x: Array, y: Array, *, name: str) -> dict[str, Any]:
    """A series in the colour of its role."""
    pen: dict[str, Any] = {"color": f"--{role}", "width": 1.4, "dash": DASHES.get(role, "solid")}
    trace = {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "x": packed(x),
        "y": packed(y),
        "line": pen,
    }
    return {**trace, "visible": "legendonly"} if role == "refitted" else trace


def dots(model: str, x: Any, y: Array, error: Array | None, *, bars: bool) -> dict[str, Any]:
    """Marks with their errors, joined where the bins have an order."""
    trace: dict[str, Any] = {
        "type": "scatter",
        "mode": "markers" if bars else "lines+markers",
        "name": NAMES[model],
        "x": x,
        "y": packed(y),
        "line": {"color": f"--{model}", "width": 1.4, "dash": DASHES[model]},
        "marker": {"color": f"--{model}", "symbol": SYMBOLS[model], "size": 10 if bars else 6},
    }
    if error is not None:
        trace["error_y"] = {"array": packed(error), "color": f"--{model}", "thickness": 1, "width": 2}
    return {**trace, "visible": "legendonly"} if model == "refitted" else trace


def layout(x: str, y: str) -> dict[str, Any]:
    """Of a picture with these titles of its axes."""
    return {
        "xaxis": axis(x),
        "yaxis": axis(y),
        "height": 320,
        "margin": {"l": 62, "r": 12, "t": 28, "b": 46},
        "paper_bgcolor": "--card",
        "plot_bgcolor": "--card",
        "font": {"color": "--ink", "size": 12, "family": "system-ui, sans-serif"},
        "legend": {"orientation": "h", "x": 0.0, "y": 1.02, "yanchor": "bottom"},
        "hovermode": "closest",
    }


def axis(text: str) -> dict[str, Any]:
    """An axis with its title."""
    return {
        "title": {"text": text, "standoff": 8},
        "gridcolor": "--grid",
        "zerolinecolor": "--line",
        "linecolor": "--line",
        "automargin": True,
    }


def band(axis: str, low: float, high: float) -> dict[str, Any]:
    """A grey band across the whole picture."""
    place = {"x0": 0.0, "x1": 1.0, "xref": "paper", "y0": low, "y1": high, "yref": axis}
    return {"type": "rect", **place, "fillcolor": "--floor-band", "line": {"width": 0}, "layer": "below"}


def held(start_s: float, end_s: float) -> dict[str, Any]:
    """A stretch of time that was held out."""
    place = {"x0": start_s, "x1": end_s, "xref": "x", "y0": 0.0, "y1": 1.0, "yref": "paper"}
    return {"type": "rect", **place, "fillcolor": "--held-out", "line": {"width": 0}, "layer": "below"}


def upright(at: float) -> dict[str, Any]:
    """A dotted line at a place."""
    place = {"x0": at, "x1": at, "xref": "x", "y0": 0.0, "y1": 1.0, "yref": "paper"}
    return {"type": "line", **place, "line": {"color": "--line", "width": 1, "dash": "dot"}, "layer": "below"}


def mark(text: str, at: float) -> dict[str, Any]:
    """Text beside such a line, on a logarithmic axis."""
    place = {"x": math.log10(at), "xref": "x", "y": 1.0, "yref": "paper", "yanchor": "top", "xanchor": "left"}
    return {"text": text, **place, "showarrow": False, "font": {"color": "--faint", "size": 11}}


def peaks(x: Array, y: Array, buckets: int) -> tuple[Array, Array]:
    """The highest sample of each of so many stretches, even in the logarithm of x; x rises, above 0."""
    if len(y) <= buckets:
        return x, y
    place = np.log(x / x[0]) * (buckets / np.log(x[-1] / x[0]))
    starts = np.flatnonzero(np.diff(np.floor(place), prepend=-1.0) > 0.0)
    top = np.maximum.reduceat(y, starts)
    stretch = np.cumsum(np.isin(np.arange(len(y)), starts)) - 1
    at = np.flatnonzero(y == top[stretch])
    _, firsts = np.unique(stretch[at], return_index=True)
    return x[at[firsts]], y[at[firsts]]
