"""Draws the report as a web page: sections in HTML, plots as data and layout for plotly.js."""

from itertools import groupby
from typing import Any

import numpy as np

from servo_ctrl.plots.figures import COLOURS
from servo_ctrl.report.content import Report, ReportPicture, ReportSection, ReportTable, Series
from servo_ctrl.report.html_file import escape, html_file, packed, table

DASHES = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot")
MARKERS = ("circle", "diamond-open", "x", "square-open", "triangle-up", "cross")
GREY, GRID = "#444c55", "#d5dae0"
COMMANDED: dict[str, Any] = {
    "type": "scatterpolar",
    "theta": list(range(0, 361, 3)),
    "r": [0.0] * 121,
    "mode": "lines",
    "line": {"color": "#000", "width": 2},
    "hoverinfo": "skip",
    "showlegend": False,
}


def page(report: Report) -> str:
    """Return the whole page."""
    drawn: dict[str, Any] = {}
    parts = [_section(number, section, drawn) for number, section in enumerate(report.sections)]
    links = "".join(
        f'<a href="#part-{number}">{escape(section.heading)}</a>'
        for number, section in enumerate(report.sections)
    )
    bad = "" if report.good else " bad"
    head = (
        f'<div class="verdict{bad}"><span class="word">{escape(report.verdict)}</span>'
        f"<h1>{escape(report.title)}</h1><p>{escape(report.sentence)}</p><nav>{links}</nav></div>"
    )
    return html_file("servo_ctrl.report", report.title, head + "".join(parts), drawn)


def _section(number: int, section: ReportSection, drawn: dict[str, Any]) -> str:
    words = "".join(f"<p>{escape(paragraph)}</p>" for paragraph in section.text)
    body = f"<section>{words}</section>" if words else ""
    for pictures, group in groupby(section.parts, lambda part: isinstance(part, ReportPicture)):
        if pictures:
            cards = "".join(_picture(part, drawn) for part in group if isinstance(part, ReportPicture))
            body += f'<div class="pictures">{cards}</div>'
        else:
            body += "".join(_table(part) for part in group if not isinstance(part, ReportPicture))
    return f'<h2 id="part-{number}">{escape(section.heading)}</h2>{body}'


def _table(part: ReportTable) -> str:
    rows = [list(map(escape, row)) for row in part.rows]
    note = f'<p class="note">{escape(part.note)}</p>' if part.note else ""
    numbers = range(part.words, len(part.head))
    return f"<section><h3>{escape(part.heading)}</h3>{table(part.head, rows, numbers)}{note}</section>"


def _picture(picture: ReportPicture, drawn: dict[str, Any]) -> str:
    polar = " polar" if picture.kind == "polar" else ""
    traces = [_trace(picture, series, place) for place, series in enumerate(picture.series)]
    drawn[picture.name] = {
        "data": [*traces, COMMANDED] if polar else traces,
        "layout": _polar_layout(picture) if polar else _layout(picture),
    }
    name, note = escape(picture.name), escape(picture.note)
    return (
        f'<figure><h3>{escape(picture.heading)}</h3><div class="plot{polar}" id="{name}" role="img" '
        f'aria-label="{escape(picture.heading)}"></div><figcaption class="note">{note}</figcaption></figure>'
    )


def _trace(picture: ReportPicture, series: Series, place: int) -> dict[str, Any]:
    colour = COLOURS[place % len(COLOURS)]
    trace: dict[str, Any] = {"name": escape(series.name), "mode": "lines"}
    if picture.kind == "polar":
        trace |= {"type": "scatterpolar", "theta": packed(np.degrees(series.x)), "r": packed(series.y)}
    else:
        trace |= {"type": "scatter", "x": packed(series.x), "y": packed(series.y), "connectgaps": False}
    marker = {"color": colour, "symbol": MARKERS[place % len(MARKERS)]}
    if series.spread is not None:
        bars = {"type": "data", "array": packed(series.spread), "color": colour}
        trace |= {"mode": "lines+markers", "marker": marker | {"size": 8}, "error_y": bars}
    if picture.kind == "points":
        outline = {"width": 2, "color": colour}
        return trace | {"mode": "markers", "marker": marker | {"size": 9, "line": outline}}
    return trace | {"line": {"color": colour, "width": 1.4, "dash": DASHES[place % len(DASHES)]}}


def _layout(picture: ReportPicture) -> dict[str, Any]:
    logarithm = {"type": "log", "exponentformat": "power"}
    across = logarithm if picture.kind in {"logarithmic", "semilogarithmic"} else {}
    upward = logarithm if picture.kind == "logarithmic" else {}
    grid = {"gridcolor": GRID, "zerolinecolor": GREY, "linecolor": GREY, "showline": True, "mirror": True}
    lines = [
        {
            "type": "line",
            "xref": "paper",
            "x0": 0,
            "x1": 1,
            "y0": level.value,
            "y1": level.value,
            "line": {"color": "#000", "width": 1.6, "dash": "longdash"},
            "label": {"text": escape(level.name), "textposition": "end"},
        }
        for level in picture.levels
    ]
    return _common(picture) | {
        "xaxis": {"title": {"text": escape(picture.x_label)}, **grid, **across},
        "yaxis": {"title": {"text": escape(picture.y_label)}, **grid, **upward},
        "shapes": lines,
    }


def _polar_layout(picture: ReportPicture) -> dict[str, Any]:
    division = picture.division
    rings = [division * k for k in (-2, -1, 0, 1, 2)]
    return _common(picture) | {
        "polar": {
            "bgcolor": "#fff",
            "radialaxis": {
                "range": [-5.0 * division, 2.6 * division],
                "tickvals": rings,
                "ticktext": [f"{ring:g} µm" if ring else "0" for ring in rings],
                "angle": 67.5,
                "tickangle": 67.5,
                "gridcolor": GRID,
                "linecolor": GREY,
            },
            "angularaxis": {"dtick": 45, "gridcolor": GRID, "linecolor": GREY},
        },
        "margin": {"l": 48, "r": 48, "t": 40, "b": 40},
    }


def _common(picture: ReportPicture) -> dict[str, Any]:
    return {
        "paper_bgcolor": "#fff",
        "plot_bgcolor": "#fff",
        "font": {"color": "#16191d"},
        "margin": {"l": 64, "r": 16, "t": 32, "b": 48},
        "showlegend": len(picture.series) > 1,
        "legend": {"orientation": "h", "y": -0.2},
    }
