"""What a run of circles shows a person: a table, two pictures, and the figures as JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Table

from servo_ctrl.experiment.circles import AXES
from servo_ctrl.experiment.published import FENG_2015_X_UNCOMPENSATED, figures_um
from servo_ctrl.telemetry.plots import plot_contour, plot_reversals

if TYPE_CHECKING:
    from pathlib import Path

    from servo_ctrl.experiment.circles import CircleResult
    from servo_ctrl.experiment.published import Figures

HEADINGS = ("contour peak", "mean |e|", "peak |e|", "RMS e")


def indicator_table(results: list[CircleResult], window_s: float) -> Table:
    """Indicators at the reversals, micrometres, with the published ones of the x axis beside them."""
    radius_mm = results[0].radius_m * 1e3
    table = Table(
        title=f"Errors at the reversals, um, over {window_s * 1e3:.0f} ms, R = {radius_mm:g} mm",
        caption="in brackets: Feng et al. 2015, table 3, without compensation",
    )
    table.add_column("F mm/min", justify="right")
    table.add_column("axis")
    for heading in HEADINGS:
        table.add_column(heading, justify="right")
    for result in results:
        for axis in AXES:
            published = FENG_2015_X_UNCOMPENSATED.get(result.feed_mm_min) if axis == AXES[0] else None
            table.add_row(
                f"{result.feed_mm_min}" if axis == AXES[0] else "",
                axis,
                *_cells(figures_um(result.indicators[axis]), published),
                end_section=axis == AXES[-1],
            )
    return table


def error_table(errors: dict[int, dict[str, float]]) -> Table:
    """Relative errors of the x axis' indicators against the published ones, per cent, by feed (mm/min)."""
    table = Table(title="x axis against the published figures: relative errors, %")
    table.add_column("F mm/min", justify="right")
    for heading in HEADINGS:
        table.add_column(heading, justify="right")
    for feed, row in errors.items():
        table.add_row(str(feed), *(f"{error:+.1f}" for error in row.values()))
    return table


def _cells(ours: Figures, published: Figures | None) -> list[str]:
    if published is None:
        return [f"{value:.2f}" for value in ours]
    return [f"{value:.2f} ({theirs:.2f})" for value, theirs in zip(ours, published, strict=True)]


def draw_circles(results: list[CircleResult], window_s: float, out: Path) -> list[Path]:
    """Draw the tracking errors at the reversals and the magnified contour; return the files."""
    reversals, contour = out / "reversals.png", out / "contour.png"
    plot_reversals(
        reversals, {axis: [result.error_traces[axis] for result in results] for axis in AXES}, window_s
    )
    plot_contour(contour, [result.contour for result in results], results[0].radius_m)
    return [reversals, contour]
