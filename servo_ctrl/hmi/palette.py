"""Colours of the page: those of Okabe and Ito, which the colour-blind can tell apart, on light and on dark.

No state is told by its colour alone: a word or a sign stands beside it.
"""

from __future__ import annotations

from typing import Any

BLACK = "#000000"
ORANGE = "#E69F00"
SKY_BLUE = "#56B4E9"
GREEN = "#009E73"
YELLOW = "#F0E442"
BLUE = "#0072B2"
VERMILION = "#D55E00"
PURPLE = "#CC79A7"

LINES_LIGHT = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY_BLUE, "#666666", BLACK)
LINES_DARK = (SKY_BLUE, ORANGE, GREEN, PURPLE, VERMILION, YELLOW, "#9AA4AD", "#FFFFFF")
"""Of curves, in the order of their use: apart from each other and from the ground."""

GROUND_LIGHT, GROUND_DARK = "#FFFFFF", "#171B1F"
INK_LIGHT, INK_DARK = "#1B1F23", "#E4E8EB"
GRID_LIGHT, GRID_DARK = "#D5DADF", "#38414A"


def lines(*, dark: bool) -> tuple[str, ...]:
    """Colours of curves on this ground."""
    return LINES_DARK if dark else LINES_LIGHT


def plot_layout(*, dark: bool) -> dict[str, Any]:
    """What a plotly figure takes as its layout to look like the page around it."""
    ink, grid, ground = (INK_DARK, GRID_DARK, GROUND_DARK) if dark else (INK_LIGHT, GRID_LIGHT, GROUND_LIGHT)
    axis = {"gridcolor": grid, "zerolinecolor": grid, "linecolor": grid, "automargin": True}
    return {
        "paper_bgcolor": ground,
        "plot_bgcolor": ground,
        "font": {"color": ink, "size": 12},
        "colorway": list(lines(dark=dark)),
        "margin": {"l": 48, "r": 12, "t": 12, "b": 40},
        "xaxis": dict(axis),
        "yaxis": dict(axis),
    }
