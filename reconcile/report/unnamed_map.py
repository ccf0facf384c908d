"""An unnamed force over position and velocity as a picture: a heat map, each cell with its 95 % interval."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from kernels.arrays import Array
from kernels.readable_units import display_unit
from reconcile.catalogue.map_term import MAP, grid_of
from reconcile.report.traces import Figure, layout

SCALE = [[0.0, "rgba(0, 114, 178, 1.0)"], [0.5, "rgba(128, 128, 128, 0.05)"], [1.0, "rgba(213, 94, 0, 1.0)"]]
"""Colours that are readable on a light and on a dark page; zero is nearly clear."""


def unnamed_map(finding: Mapping[str, Any]) -> Figure | None:
    """Return the picture of a finding; None where it is not a force over position and velocity."""
    if finding.get("over") != MAP:
        return None
    parameters = finding["parameters"]
    positions, velocities, heights = grid_of({key: one["value"] for key, one in parameters.items()})
    ends = [grid_of({key: one["ci95"][end] for key, one in parameters.items()})[2] for end in (0, 1)]
    place_factor, place_unit = display_unit(parameters["at_1"]["unit"], max(map(abs, positions)))
    speed_factor, speed_unit = display_unit(parameters["at_velocity_1"]["unit"], max(map(abs, velocities)))
    factor, unit = display_unit(_force_unit(finding), float(np.abs(heights).max()))
    most = float(np.abs(heights).max()) / factor
    figure_layout = layout(f"position ({place_unit})", f"velocity ({speed_unit})")
    trace: dict[str, Any] = {
        "type": "heatmap",
        "x": [place / place_factor for place in positions],
        "y": [speed / speed_factor for speed in velocities],
        "z": (heights.T / factor).tolist(),
        "text": _intervals(ends[0].T / factor, ends[1].T / factor),
        "zmin": -most,
        "zmax": most,
        "colorscale": SCALE,
        "colorbar": {"title": {"text": unit}, "thickness": 12},
        "texttemplate": "%{z:.2g}<br>%{text}",
        "textfont": {"size": 9},
        "hovertemplate": f"%{{x:.3g}} {place_unit}, %{{y:.3g}} {speed_unit}: %{{z:.3g}} {unit}<br>%{{text}}"
        "<extra></extra>",
    }
    note = "Force that the motor needs, above its mean. Below each value: 95 % of what resampled blocks give."
    note += " Cells that the motion did not pass are a smooth continuation."
    return Figure("map", "Force over position and velocity", note, [trace], figure_layout)


def map_as_text(finding: Mapping[str, Any]) -> str:
    """Return the map of a finding as a line of text; empty where it is none."""
    if finding.get("over") != MAP:
        return ""
    heights = [one["value"] for key, one in finding["parameters"].items() if key.startswith("height_")]
    factor, unit = display_unit(_force_unit(finding), max(map(abs, heights)))
    return (
        f"force over position and velocity from {min(heights) / factor:.3g} to {max(heights) / factor:.3g} "
        f"{unit} (the report draws it)"
    )


def _intervals(low: Array, high: Array) -> list[list[str]]:
    return [
        [f"{a:.2g} to {b:.2g}" for a, b in zip(*rows, strict=True)] for rows in zip(low, high, strict=True)
    ]


def _force_unit(finding: Mapping[str, Any]) -> str:
    return "N m" if finding["parameters"]["at_1"]["unit"] == "rad" else "N"
