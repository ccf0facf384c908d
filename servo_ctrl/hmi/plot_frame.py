"""What the plots of the pages have in common."""

from __future__ import annotations

from typing import Any

from servo_ctrl.hmi.palette import plot_layout


def layout_of(x: str, y: str, *, dark: bool) -> dict[str, Any]:
    """A plot with these axes, its legend above it."""
    layout: dict[str, Any] = {**plot_layout(dark=dark), "showlegend": True}
    layout["xaxis"] = {**layout["xaxis"], "title": {"text": x}}
    layout["yaxis"] = {**layout["yaxis"], "title": {"text": y}}
    layout["legend"] = {"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0}
    return layout


def figure_of(data: list[dict[str, Any]], layout: dict[str, Any], *, revision: str) -> dict[str, Any]:
    """A figure that stays zoomed as long as `revision` stays."""
    config = {"displaylogo": False, "responsive": True, "displayModeBar": False}
    return {"data": data, "layout": {**layout, "uirevision": revision}, "config": config}
