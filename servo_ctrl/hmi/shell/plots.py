"""Colours of the pages, and plotly figures of one look as dictionaries, which need no import of plotly.

The colours are those of Okabe and Ito, which the colour-blind can tell apart, on light and on dark. No state
is shown by its colour alone: a word or a sign stands beside it.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

from servo_ctrl.hmi.shell.units import UnitSystem

BLACK = "#000000"
ORANGE = "#E69F00"
SKY_BLUE = "#56B4E9"
GREEN = "#009E73"
YELLOW = "#F0E442"
BLUE = "#0072B2"
VERMILION = "#D55E00"
PURPLE = "#CC79A7"
GREY_LIGHT, GREY_DARK = "#666666", "#9AA4AD"

CURVES_LIGHT = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY_BLUE, GREY_LIGHT, BLACK)
CURVES_DARK = (SKY_BLUE, ORANGE, GREEN, PURPLE, VERMILION, YELLOW, GREY_DARK, "#FFFFFF")
"""Colours of curves in the order of their use: distinct from each other and from the background."""
VIRIDIS = ("#440154", "#482878", "#3e4989", "#31688e", "#26828e", "#1f9e89", "#35b779", "#6ece58", "#b5de2b")
"""From slow to fast; a theme leaves out the end that cannot be seen on its background."""


class Theme(NamedTuple):
    """Colours of a plot on one background; equal to those of static/bench.css around it."""

    background: str
    ink: str
    grid: str
    curves: tuple[str, ...]
    grey: str
    """For what belongs to no curve."""
    speeds: tuple[str, ...]
    """From slow to fast."""

    def curve(self, number: int) -> str:
        """Return the colour of a curve by its number, from 0; they repeat after eight."""
        return self.curves[number % len(self.curves)]


LIGHT = Theme(
    background="#FFFFFF",
    ink="#1B1F23",
    grid="#D5DADF",
    curves=CURVES_LIGHT,
    grey=GREY_LIGHT,
    speeds=VIRIDIS[:8],
)
DARK = Theme(
    background="#171B1F",
    ink="#E4E8EB",
    grid="#38414A",
    curves=CURVES_DARK,
    grey=GREY_DARK,
    speeds=VIRIDIS[3:],
)


class Look(NamedTuple):
    """Units and colours of a visitor's figures."""

    units: UnitSystem
    theme: Theme


def plot_layout(x: str, y: str, theme: Theme) -> dict[str, Any]:
    """Return a layout with these axis titles and the legend above the plot."""
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
    """Return a scatter trace; None in `y` is a gap. `fields` are those of plotly, as `line` and `marker`."""
    return {"type": "scatter", "mode": mode, "name": name, "x": x, "y": y, **fields}


def figure(data: list[dict[str, Any]], layout: dict[str, Any], *, revision: str) -> dict[str, Any]:
    """Return a figure that keeps its zoom while `revision` is the same."""
    config = {"displaylogo": False, "responsive": True, "displayModeBar": False}
    return {"data": data, "layout": {**layout, "uirevision": revision}, "config": config}


def horizontal_line(text: str, y: float, colour: str) -> dict[str, Any]:
    """Return layout entries of a dashed line across the plot with a text above its right end."""
    shape = {"type": "line", "xref": "paper", "x0": 0, "x1": 1, "y0": y, "y1": y}
    label = {"text": text, "xref": "paper", "x": 1, "xanchor": "right", "y": y, "yanchor": "bottom"}
    return {
        "shapes": [{**shape, "line": {"color": colour, "dash": "dash", "width": 2}}],
        "annotations": [{**label, "showarrow": False, "font": {"color": colour}}],
    }
