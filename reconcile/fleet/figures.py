"""Figures of a fleet: effects over machines, and the size of each effect relative to the fleet's median."""

import html
from typing import Any

import numpy as np

from reconcile.fleet.rows import Row
from reconcile.fleet.summary import FleetSummary, SharedEffect, heldout_gain
from reconcile.report.traces import Figure, layout
from reconcile.report.words import display_name, percent, quantity
from servo_ctrl.report.html_file import packed

MAX_MACHINES, MAX_POINTS = 400, 20_000
"""Most columns of the map and points of the spreads, for a browser to draw at once; chosen."""
MAX_NAMED_MACHINES = 60
"""Most columns of the map with room for their names."""
TICKS = [digit * 10.0**decade for decade in range(-4, 5) for digit in (1, 2, 5)]
MIN_DECADES = 0.5
"""Least decades to either side of the median, so that small differences look small."""
SCALE = [[0.0, "rgba(0, 114, 178, 0.10)"], [1.0, "rgba(0, 114, 178, 1.0)"]]
"""Colours that are readable on a light and on a dark page."""


def effect_map(found: FleetSummary) -> Figure | None:
    """Draw machine over effect: the largest held-out gain of the effect on one of the machine's axes."""
    lacking = [machine for group in found.groups if group.effects for machine in group.machines]
    shown = lacking[:MAX_MACHINES]
    if not shown:
        return None
    effects = [one.effect for one in found.shared]
    column_of = {machine: column for column, machine in enumerate(shown)}
    gains: list[list[float | None]] = [[None] * len(shown) for _ in effects]
    words = [[""] * len(shown) for _ in effects]
    for line, one in enumerate(found.shared):
        for row in one.axes:
            column = column_of.get(row["machine"])
            if column is None:
                continue
            gains[line][column] = max(gains[line][column] or 0.0, heldout_gain(row, one.effect))
            words[line][column] += html.escape(_axis_text(row, one.effect)) + "<br>"
    drawing = layout("machine, those alike side by side", "")
    drawing["height"] = max(320, 150 + 26 * len(effects))
    drawing["xaxis"].update(type="category", showticklabels=len(shown) <= MAX_NAMED_MACHINES)
    drawing["yaxis"].update(type="category", autorange="reversed")
    data: dict[str, Any] = {
        "type": "heatmap",
        "x": [html.escape(machine) for machine in shown],
        "y": [html.escape(display_name(effect)) for effect in effects],
        "z": gains,
        "text": words,
        "zmin": 0.0,
        "zmax": 1.0,
        "xgap": 1,
        "ygap": 2,
        "colorscale": SCALE,
        "colorbar": {"title": {"text": "worth"}, "thickness": 12},
        "hovertemplate": "%{x}: %{y}<br>%{text}<extra></extra>",
    }
    note = (
        "How much of the squared error, on stretches that were held out, the effect explains: the most of "
        "the machine's axes. Machines whose models lack the same lie side by side."
    )
    if len(lacking) > len(shown):
        note += f" The {len(shown)} of the largest groups are shown, of {len(lacking)} that lack something."
    return Figure("heat", "Which machine lacks what", note, [data], drawing)


def size_spreads(found: FleetSummary) -> Figure | None:
    """Draw the size of each effect on each axis, divided by the fleet's median of it."""
    data = []
    remaining, decades = MAX_POINTS, MIN_DECADES
    for one in found.shared:
        sizes = _sizes(one)[:remaining]
        remaining -= len(sizes)
        if len(sizes) < 2:
            continue
        median = float(np.median([abs(value) for value, _, _ in sizes]))
        if median <= 0.0:
            continue
        ratios = np.array([abs(value) / median for value, _, _ in sizes])
        decades = max(decades, 1.05 * float(np.abs(np.log10(ratios)).max()))
        name = html.escape(display_name(one.effect))
        data.append(
            {
                "type": "scatter",
                "mode": "markers",
                "name": name,
                "x": packed(ratios),
                "y": [name] * len(sizes),
                "text": [html.escape(f"{axis}: {quantity(value, unit)}") for value, unit, axis in sizes],
                "hovertemplate": "%{text}<extra></extra>",
                "marker": {"color": "--accent", "size": 9, "opacity": 0.45},
                "showlegend": False,
            }
        )
    if not data:
        return None
    drawing = layout("size over the fleet's median", "")
    drawing["height"] = max(320, 110 + 30 * len(data))
    drawing["xaxis"].update(
        type="log", range=[-decades, decades], tickvals=TICKS, ticktext=[f"{tick:g}" for tick in TICKS]
    )
    drawing["yaxis"].update(type="category", autorange="reversed")
    note = (
        "A dot is an axis; right of 1 the effect is larger than on most others. The first parameter counts."
    )
    return Figure("spreads", "Whose is larger than the others'", note, data, drawing)


def _sizes(one: SharedEffect) -> list[tuple[float, str, str]]:
    """Return value, unit and axis of the effect's first parameter, wherever it is known."""
    # a harmonic number says how often an effect repeats, not how large it is
    names = [spread.name for spread in one.spreads if spread.unit != "1/turn"]
    if not names:
        return []
    return [
        (parameter["value"], parameter["unit"], f"{row['machine']}/{row['axis']}")
        for row in one.axes
        for finding in row["effects"]
        if finding["effect"] == one.effect
        for parameter in finding["parameters"]
        if parameter["name"] == names[0] and parameter["value"]
    ]


def _axis_text(row: Row, effect: str) -> str:
    """Return `axis x, 43 %: play 3.02 µm`."""
    first = next(one for one in row["effects"] if one["effect"] == effect)
    sizes = ", ".join(
        f"{parameter['name']} {quantity(parameter['value'], parameter['unit'])}"
        for parameter in first["parameters"][:3]
        if parameter["value"] is not None
    )
    return f"axis {row['axis']}, {percent(heldout_gain(row, effect))}: {sizes}"
