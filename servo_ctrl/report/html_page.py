"""The report as one file of HTML with plotly.js: it opens without a network. Only this file knows plotly."""

import html
import json
from importlib.resources import files
from itertools import groupby
from typing import Any

import numpy as np
from plotly.offline import get_plotlyjs

from servo_ctrl.plots.figures import COLOURS
from servo_ctrl.report.content import Report, ReportPicture, ReportSection, ReportTable, Series
from servo_ctrl.report.packed import packed

POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"
"""Content security policy: the page may load nothing, all it shows is in it."""
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
    """The whole page."""
    drawn: dict[str, Any] = {}
    parts = [_section(number, section, drawn) for number, section in enumerate(report.sections)]
    links = "".join(
        f'<a href="#part-{number}">{_text(section.heading)}</a>'
        for number, section in enumerate(report.sections)
    )
    # a "<" in a name could end the script element or begin another
    data = json.dumps(drawn, allow_nan=False).replace("<", "\\u003c")
    asset = files("servo_ctrl.report")
    style, script = (asset.joinpath(name).read_text(encoding="utf-8") for name in ("page.css", "page.js"))
    bad = "" if report.good else " bad"
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{_text(report.title)}</title><style>{style}</style></head><body><main>"
        f'<div class="verdict{bad}"><span class="word">{_text(report.verdict)}</span>'
        f"<h1>{_text(report.title)}</h1><p>{_text(report.sentence)}</p><nav>{links}</nav></div>"
        f"{''.join(parts)}</main>"
        f'<script type="application/json" id="pictures">{data}</script>'
        f"<script>{get_plotlyjs()}</script><script>{script}</script></body></html>\n"
    )


def _section(number: int, section: ReportSection, drawn: dict[str, Any]) -> str:
    words = "".join(f"<p>{_text(paragraph)}</p>" for paragraph in section.text)
    body = f"<section>{words}</section>" if words else ""
    for pictures, group in groupby(section.parts, lambda part: isinstance(part, ReportPicture)):
        if pictures:
            cards = "".join(_picture(part, drawn) for part in group if isinstance(part, ReportPicture))
            body += f'<div class="pictures">{cards}</div>'
        else:
            body += "".join(_table(part) for part in group if not isinstance(part, ReportPicture))
    return f'<h2 id="part-{number}">{_text(section.heading)}</h2>{body}'


def _table(table: ReportTable) -> str:
    def cells(tag: str, row: tuple[str, ...]) -> str:
        marks = [' class="left"' if place < table.words else "" for place in range(len(row))]
        return "".join(f"<{tag}{mark}>{_text(cell)}</{tag}>" for mark, cell in zip(marks, row, strict=True))

    head = f"<tr>{cells('th', table.head)}</tr>" if any(table.head) else ""
    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in table.rows)
    note = f'<p class="note">{_text(table.note)}</p>' if table.note else ""
    heading = f"<h3>{_text(table.heading)}</h3>"
    return f'<section>{heading}<div class="scroll"><table>{head}{body}</table></div>{note}</section>'


def _picture(picture: ReportPicture, drawn: dict[str, Any]) -> str:
    polar = " polar" if picture.kind == "polar" else ""
    traces = [_trace(picture, series, place) for place, series in enumerate(picture.series)]
    drawn[picture.name] = {
        "data": [*traces, COMMANDED] if polar else traces,
        "layout": _polar_layout(picture) if polar else _layout(picture),
    }
    name, note = _text(picture.name), _text(picture.note)
    return (
        f'<figure><h3>{_text(picture.heading)}</h3><div class="plot{polar}" id="{name}" role="img" '
        f'aria-label="{_text(picture.heading)}"></div><figcaption class="note">{note}</figcaption></figure>'
    )


def _trace(picture: ReportPicture, series: Series, place: int) -> dict[str, Any]:
    colour = COLOURS[place % len(COLOURS)]
    trace: dict[str, Any] = {"name": _text(series.name), "mode": "lines"}
    if picture.kind == "polar":
        trace |= {"type": "scatterpolar", "theta": packed(np.degrees(series.x)), "r": packed(series.y)}
    else:
        trace |= {"type": "scatter", "x": packed(series.x), "y": packed(series.y), "connectgaps": False}
    if series.spread is not None:
        symbol = {"color": colour, "symbol": MARKERS[place % len(MARKERS)], "size": 8}
        bars = {"type": "data", "array": packed(series.spread), "color": colour}
        trace |= {"mode": "lines+markers", "marker": symbol, "error_y": bars}
    if picture.kind == "points":
        return trace | {
            "mode": "markers",
            "marker": {
                "color": colour,
                "symbol": MARKERS[place % len(MARKERS)],
                "size": 9,
                "line": {"width": 2, "color": colour},
            },
        }
    return trace | {"line": {"color": colour, "width": 1.4, "dash": DASHES[place % len(DASHES)]}}


def _layout(picture: ReportPicture) -> dict[str, Any]:
    scale = {"type": "log", "exponentformat": "power"} if picture.kind == "logarithmic" else {}
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
            "label": {"text": _text(level.name), "textposition": "end"},
        }
        for level in picture.levels
    ]
    return _common(picture) | {
        "xaxis": {"title": {"text": _text(picture.x_label)}, **grid, **scale},
        "yaxis": {"title": {"text": _text(picture.y_label)}, **grid, **scale},
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
                "ticktext": [f"{ring:g} um" if ring else "0" for ring in rings],
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


def _text(value: str) -> str:
    return html.escape(value)
