"""Traces, axes and marks of figures in the format of plotly.js.

A colour is the name of a CSS variable, `--` and the role of the drawn quantity (`--before`); the page
replaces it by the colour of that role in its light or dark style.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.report.html_file import packed

MODEL_NAMES = {"before": "nominal model", "refitted": "its values refitted", "after": "with the effects"}
DASHES = {"before": "solid", "refitted": "dot", "after": "solid"}
SYMBOLS = {"before": "circle-open", "refitted": "diamond-open", "after": "square"}
LOGARITHMIC = {"type": "log", "dtick": 1, "exponentformat": "none"}


class Figure(NamedTuple):
    """Data and layout for plotly.js; `heading` and `note` are plain text beside it."""

    name: str
    heading: str
    note: str
    data: list[dict[str, Any]]
    layout: dict[str, Any]


def line(role: str, x: Array, y: Array, *, name: str) -> dict[str, Any]:
    """Return a line in the colour of its role; that of the refitted model is hidden until it is clicked."""
    trace = {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "x": packed(x),
        "y": packed(y),
        "line": {"color": f"--{role}", "width": 1.4, "dash": DASHES.get(role, "solid")},
    }
    return {**trace, "visible": "legendonly"} if role == "refitted" else trace


def dots(model: str, x: Any, y: Array, error: Array | None, *, categories: bool) -> dict[str, Any]:
    """Return marks with error bars, joined by a line unless x holds `categories`."""
    trace: dict[str, Any] = {
        "type": "scatter",
        "mode": "markers" if categories else "lines+markers",
        "name": MODEL_NAMES[model],
        "x": x,
        "y": packed(y),
        "line": {"color": f"--{model}", "width": 1.4, "dash": DASHES[model]},
        "marker": {"color": f"--{model}", "symbol": SYMBOLS[model], "size": 10 if categories else 6},
    }
    if error is not None:
        trace["error_y"] = error_bars(f"--{model}", array=packed(error))
    return {**trace, "visible": "legendonly"} if model == "refitted" else trace


def error_bars(colour: str, **arrays: Any) -> dict[str, Any]:
    """Return thin error bars; `arrays` are plotly's `array` and `arrayminus`."""
    return {**arrays, "color": colour, "thickness": 1, "width": 2}


def layout(x: str, y: str) -> dict[str, Any]:
    """Return the layout of a figure with these titles of its axes."""
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


def stacked(upper: str, lower: str, lower_height: float) -> dict[str, Any]:
    """Return the layout of two diagrams over time; the lower one (`y2`) has a share of the height."""
    both = layout("time (s)", upper)
    both["xaxis"].update(anchor="y2", domain=[0.0, 1.0])
    both["yaxis"]["domain"] = [lower_height + 0.08, 1.0]
    both["yaxis2"] = {**axis(lower), "domain": [0.0, lower_height]}
    both["height"] = 430
    return both


def axis(text: str) -> dict[str, Any]:
    """Return an axis with its title."""
    return {
        "title": {"text": text, "standoff": 8},
        "gridcolor": "--grid",
        "zerolinecolor": "--line",
        "linecolor": "--line",
        "automargin": True,
    }


def band(half_width: float) -> dict[str, Any]:
    """Return a grey band about zero over the whole width."""
    return _area("--floor-band", x0=0.0, x1=1.0, xref="paper", y0=-half_width, y1=half_width, yref="y")


def interval_band(start: float, end: float, colour: str) -> dict[str, Any]:
    """Return a band over the whole height, between two values of x."""
    return _area(colour, x0=start, x1=end, xref="x", y0=0.0, y1=1.0, yref="paper")


def upright(at: float, colour: str = "--line", width: float = 1) -> dict[str, Any]:
    """Return a dotted line over the whole height at a value of x."""
    where = {"x0": at, "x1": at, "xref": "x", "y0": 0.0, "y1": 1.0, "yref": "paper"}
    return {
        "type": "line",
        **where,
        "line": {"color": colour, "width": width, "dash": "dot"},
        "layer": "below",
    }


def mark(text: str, at: float) -> dict[str, Any]:
    """Return text on top of the diagram at a value of a logarithmic x axis."""
    where = {"x": math.log10(at), "xref": "x", "y": 1.0, "yref": "paper", "yanchor": "top", "xanchor": "left"}
    return {"text": text, **where, "showarrow": False, "font": {"color": "--faint", "size": 11}}


def peaks(x: Array, y: Array, buckets: int) -> tuple[Array, Array]:
    """Thin a spectrum to the highest point of each of `buckets` intervals of equal width in log x.

    x rises and is positive.
    """
    if len(y) <= buckets:
        return x, y
    place = np.log(x / x[0]) * (buckets / np.log(x[-1] / x[0]))
    starts = np.flatnonzero(np.diff(np.floor(place), prepend=-1.0) > 0.0)
    top = np.maximum.reduceat(y, starts)
    bucket = np.cumsum(np.isin(np.arange(len(y)), starts)) - 1
    at = np.flatnonzero(y == top[bucket])
    _, firsts = np.unique(bucket[at], return_index=True)
    return x[at[firsts]], y[at[firsts]]


def _area(colour: str, **where: Any) -> dict[str, Any]:
    return {"type": "rect", **where, "fillcolor": colour, "line": {"width": 0}, "layer": "below"}
