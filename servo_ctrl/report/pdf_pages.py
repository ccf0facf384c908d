"""Draws the report as a PDF with matplotlib: the content of the page on A4, readable in black and white."""

import io
from typing import Any, cast

import numpy as np

from servo_ctrl.plots.figures import COLOURS
from servo_ctrl.plots.matplotlib_agg import Axes, Figure, PdfPages, PolarAxes
from servo_ctrl.report.content import Report, ReportPicture, ReportSection, ReportTable, Series
from servo_ctrl.report.pdf_sheets import GREY, Sheets

DASHES = ("solid", "dashed", "dotted", "dashdot", (0, (8, 2)), (0, (8, 2, 1, 2)))
MARKERS = ("o", "D", "x", "s", "^", "+")
OPEN = ("D", "s")
"""Markers drawn as outlines."""
TALL, ROUND = 50.0, 115.0
"""Heights of plots, mm."""
BELOW_HEADING, BELOW_PICTURE = 40.0, 12.0
"""Heights that must follow the heading of a section, and of a plot, on the same sheet, mm."""


def pdf(report: Report) -> bytes:
    """Return the whole document."""
    stream = io.BytesIO()
    with PdfPages(stream, metadata={"Title": report.title, "Creator": "servo-ctrl report"}) as pages:
        for figure in sheets_of(report):
            pages.savefig(figure)
    return stream.getvalue()


def sheets_of(report: Report) -> list[Figure]:
    """Draw the sheets."""
    sheets = Sheets(report.title)
    sheets.room(1.0)
    sheets.paragraph(report.title, 15.0, bold=True)
    sheets.gap(2.0)
    sheets.paragraph(report.verdict, 11.0, bold=True)
    sheets.paragraph(report.sentence, 9.0)
    for section in report.sections:
        _section(sheets, section)
    sheets.finish()
    return sheets.figures


def _section(sheets: Sheets, section: ReportSection) -> None:
    sheets.gap(5.0)
    sheets.paragraph(section.heading, 12.0, bold=True, keep=_kept(section))
    sheets.gap(1.0)
    for text in section.text:
        sheets.paragraph(text, 8.5)
    for part in section.parts:
        sheets.gap(3.0)
        if isinstance(part, ReportPicture):
            _picture(sheets, part)
        else:
            _table(sheets, part)


def _kept(section: ReportSection) -> float:
    """Return the height that must follow the heading on its sheet."""
    match section:
        case ReportSection(text=(), parts=(ReportPicture() as first, *_)):
            return _height(first) + BELOW_PICTURE
    return BELOW_HEADING


def _height(picture: ReportPicture) -> float:
    return ROUND if picture.kind == "polar" else TALL


def _table(sheets: Sheets, table: ReportTable) -> None:
    sheets.paragraph(table.heading, 9.0, bold=True, keep=15.0)
    sheets.gap(0.5)
    sheets.table(table.head, table.rows, table.words)
    if table.note:
        sheets.gap(0.5)
        sheets.paragraph(table.note, 7.0, colour=GREY)


def _picture(sheets: Sheets, picture: ReportPicture) -> None:
    height = _height(picture)
    sheets.paragraph(picture.heading, 9.0, bold=True, keep=height + 6.0)
    if picture.kind == "polar":
        _polar(cast("PolarAxes", sheets.axes(height, polar=True)), picture)
    else:
        _plain(sheets.axes(height), picture)
    if picture.note:
        sheets.paragraph(picture.note, 7.0, colour=GREY)


def _style(series: Series, place: int) -> dict[str, Any]:
    return {
        "color": COLOURS[place % len(COLOURS)],
        "linestyle": DASHES[place % len(DASHES)],
        "linewidth": 0.9,
        "label": series.name,
    }


def _plain(axes: Axes, picture: ReportPicture) -> None:
    for place, series in enumerate(picture.series):
        style, marker = _style(series, place), MARKERS[place % len(MARKERS)]
        if series.spread is not None:
            bars: dict[str, Any] = {"marker": marker, "markersize": 4.0, "capsize": 3.0}
            axes.errorbar(series.x, series.y, series.spread, **bars, **style)
        elif picture.kind == "points":
            face = "none" if marker in OPEN else style["color"]
            dots: dict[str, Any] = {
                "linestyle": "none",
                "marker": marker,
                "markersize": 4.5,
                "markerfacecolor": face,
            }
            axes.plot(series.x, series.y, **(style | dots))
        else:
            axes.plot(series.x, series.y, **style)
    for level in picture.levels:
        axes.axhline(level.value, color="black", linewidth=1.0, linestyle=(0, (6, 3)))
        right_end, of_axes = (1.0, level.value), ("axes fraction", "data")
        axes.annotate(level.name, right_end, xycoords=of_axes, size=7, ha="right", va="bottom")
    if picture.kind == "logarithmic":
        axes.set_xscale("log")
        axes.set_yscale("log")
    axes.set_xlabel(picture.x_label, size=8)
    axes.set_ylabel(picture.y_label, size=8)
    _finish(axes, len(picture.series))


def _polar(axes: PolarAxes, picture: ReportPicture) -> None:
    for place, series in enumerate(picture.series):
        axes.plot(series.x, series.y, **_style(series, place))
    axes.plot(np.linspace(0.0, 2.0 * np.pi, 361), np.zeros(361), color="black", linewidth=1.3)
    rings = [picture.division * k for k in (-2, -1, 0, 1, 2)]
    axes.set_rlim(-5.0 * picture.division, 2.6 * picture.division)
    axes.set_rgrids(rings, [f"{ring:g} µm" if ring else "0" for ring in rings], angle=67.5)
    _finish(axes, len(picture.series))


def _finish(axes: Axes, series: int) -> None:
    axes.tick_params(labelsize=7)
    axes.grid(visible=True, color="0.85", linewidth=0.5)
    if series > 1:
        axes.legend(fontsize=7, loc="best" if axes.name != "polar" else (-0.25, 0.0))
