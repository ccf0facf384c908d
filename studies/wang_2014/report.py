"""Tables of the positioning study: simple figures beside the published ones, ISO 230-2, bars."""

from collections.abc import Mapping

from rich.console import Console
from rich.markdown import Markdown

from studies.markdown_table import markdown_table, titled
from studies.wang_2014.bus_study import BusCheck
from studies.wang_2014.plan import AT_100MM, IRREGULAR, OVER_TRAVEL
from studies.wang_2014.readings import Deviations
from studies.wang_2014.stages import STAGES
from studies.wang_2014.study import UM, WANG_2014_UM, bars, iso_figures, missed, simple_figures

Found = Mapping[tuple[str, str], Deviations]

SAME_M = 1e-12
"""Bounds the difference of readings that count as equal; in practice they agree to the last bit."""


def print_study(console: Console, found: Found, checks: list[BusCheck]) -> None:
    """Print all tables."""
    console.print(_simple(found))
    for series in (OVER_TRAVEL.name, IRREGULAR.name):
        console.print(_iso(found, series))
    for check in checks:
        same = check.difference_m < SAME_M
        console.print(
            f"over the bus, {check.bus.stage}: {check.bus.scale_m.size} readings, largest difference from "
            f"the twin {check.difference_m * UM:.3g} um, {check.bus.times_real_time:.1f} times real time",
            style="" if same else "bold red",
            highlight=False,
        )
    entries = bars(found)
    for bar in missed(entries):
        console.print(
            f"missed: {bar.what}: {bar.value:.2f}, bar {bar.limit:.2f}", style="bold red", highlight=False
        )
    if entries and not missed(entries):
        console.print(
            "every bar is met: each stage better than the one before, the last as good as published, flat",
            style="green",
        )


def _simple(found: Found) -> Markdown:
    at_100mm, over_travel = (simple_figures(found, series.name) for series in (AT_100MM, OVER_TRAVEL))
    rows = []
    for stage in (name for name in STAGES if name in at_100mm or name in over_travel):
        cells = [
            f"{figures[stage].largest_um:.2f} ({figures[stage].mean_um:.2f})" if stage in figures else ""
            for figures in (at_100mm, over_travel)
        ]
        published = f"{WANG_2014_UM[stage]:.2f}" if stage in WANG_2014_UM else ""
        slope = f"{over_travel[stage].slope_um_mm * 1e3:.1f}" if stage in over_travel else ""
        rows.append((stage, cells[0], published, cells[1], slope))
    heads = ("stage", "at 100 mm", "published", "over travel", "slope of the means, nm/mm")
    title = "Deviations by the scale, um: largest (mean); published: Wang et al. 2014, at 100 mm"
    return titled(title, markdown_table(heads, rows))


def _iso(found: Found, series: str) -> Markdown:
    rows = []
    for stage, figures in iso_figures(found, series).items():
        each = (figures, figures.up, figures.down)
        names = ("accuracy_m", "repeatability_m", "systematic_m")
        values = [getattr(one, name) for name in names for one in each]
        rows.append((stage, *(f"{value * UM:.2f}" for value in (*values, figures.reversal_m))))
    title = f"ISO 230-2, um, by an ideal interferometer at the measured point: {series}"
    heads = ("stage", "A", "up", "down", "R", "up", "down", "E", "up", "down", "B")
    return titled(title, markdown_table(heads, rows))
