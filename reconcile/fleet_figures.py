"""Pictures of a fleet: effects over machines, and how far each effect's size lies from the fleet's middle."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING, Any

import numpy as np

from reconcile.fleet_summary import worth
from reconcile.report_figures import Figure
from reconcile.report_traces import layout
from reconcile.report_words import percent, quantity, title
from servo_ctrl.report.packed import packed

if TYPE_CHECKING:
    from reconcile.fleet_rows import Row
    from reconcile.fleet_summary import FleetSummary, Shared

MOST_MACHINES = 400
MOST_POINTS = 20_000
TICKS = [digit * 10.0**decade for decade in range(-4, 5) for digit in (1, 2, 5)]
LEAST_REACH = 0.5
"""Decades to both sides, that small differences look small."""
SCALE = [[0.0, "rgba(0, 114, 178, 0.10)"], [1.0, "rgba(0, 114, 178, 1.0)"]]
"""Seen on a light and on a dark page."""


def heat(found: FleetSummary) -> Figure | None:
    """Machine over effect: the largest share of the squares that the effect is worth on one of its axes."""
    alike = [machine for group in found.groups if group.effects for machine in group.machines]
    shown = alike[:MOST_MACHINES]
    if not shown:
        return None
    effects = [one.effect for one in found.shared]
    place = {machine: index for index, machine in enumerate(shown)}
    z: list[list[float | None]] = [[None] * len(shown) for _ in effects]
    words = [[""] * len(shown) for _ in effects]
    for row_number, one in enumerate(found.shared):
        for row in one.axes:  # the one to which it is worth most comes first
            column = place.get(row["machine"])
            if column is None:
                continue
            z[row_number][column] = max(z[row_number][column] or 0.0, worth(row, one.effect))
            words[row_number][column] += html.escape(_told(row, one.effect)) + "<br>"
    page = layout("machine, those alike side by side", "")
    page["height"] = max(320, 150 + 26 * len(effects))
    page["xaxis"].update(type="category", showticklabels=len(shown) <= 60)
    page["yaxis"].update(type="category", autorange="reversed")
    data: dict[str, Any] = {
        "type": "heatmap",
        "x": [html.escape(machine) for machine in shown],
        "y": [html.escape(title(effect)) for effect in effects],
        "z": z,
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
    if len(alike) > len(shown):
        note += f" The {len(shown)} of the largest groups are shown, of {len(alike)} that lack something."
    return Figure("heat", "Which machine lacks what", note, [data], page)


def spreads(found: FleetSummary) -> Figure | None:
    """The size of each effect on each axis, over the fleet's median of it."""
    data = []
    left, reach = MOST_POINTS, LEAST_REACH
    for one in found.shared:
        sizes = _sizes(one)[:left]
        left -= len(sizes)
        if len(sizes) < 2:
            continue
        middle = float(np.median([abs(value) for value, _, _ in sizes]))
        if middle <= 0.0:
            continue
        ratios = np.array([abs(value) / middle for value, _, _ in sizes])
        reach = max(reach, 1.05 * float(np.abs(np.log10(ratios)).max()))
        data.append(
            {
                "type": "scatter",
                "mode": "markers",
                "name": html.escape(title(one.effect)),
                "x": packed(ratios),
                "y": [html.escape(title(one.effect))] * len(sizes),
                "text": [html.escape(f"{at}: {quantity(value, unit)}") for value, unit, at in sizes],
                "hovertemplate": "%{text}<extra></extra>",
                "marker": {"color": "--accent", "size": 9, "opacity": 0.45},
                "showlegend": False,
            }
        )
    if not data:
        return None
    page = layout("size over the fleet's median", "")
    page["height"] = max(320, 110 + 30 * len(data))
    page["xaxis"].update(
        type="log", range=[-reach, reach], tickvals=TICKS, ticktext=[f"{tick:g}" for tick in TICKS]
    )
    page["yaxis"].update(type="category", autorange="reversed")
    note = (
        "A dot is an axis; right of 1 the effect is larger than on most others. The first parameter counts."
    )
    return Figure("spreads", "Whose is larger than the others'", note, data, page)


def _sizes(one: Shared) -> list[tuple[float, str, str]]:
    """Value, unit and place of the effect's first parameter, wherever it is known."""
    sized = [spread.name for spread in one.spreads if spread.unit != "1/turn"]  # how often is not how much
    if not sized:
        return []
    name = sized[0]
    return [
        (parameter["value"], parameter["unit"], f"{row['machine']}/{row['axis']}")
        for row in one.axes
        for finding in row["effects"]
        if finding["effect"] == one.effect
        for parameter in finding["parameters"]
        if parameter["name"] == name and parameter["value"]
    ]


def _told(row: Row, effect: str) -> str:
    """`axis x, 43 %: play 3.02 µm`."""
    first = next(one for one in row["effects"] if one["effect"] == effect)
    sizes = ", ".join(
        f"{parameter['name']} {quantity(parameter['value'], parameter['unit'])}"
        for parameter in first["parameters"][:3]
        if parameter["value"] is not None
    )
    return f"axis {row['axis']}, {percent(worth(row, effect))}: {sizes}"
