"""Report of a run of circles: a table of indicators, and two pictures."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from rich.table import Table

from servo_ctrl.metrology.circles import AXES, CircleResult, ReversalFigures, figures_um
from servo_ctrl.plots.figures import plot_contour, plot_reversals

HEADINGS = ("contour peak", "mean |e|", "peak |e|", "RMS e")


def indicator_table(
    results: list[CircleResult],
    window_s: float,
    reference: Mapping[int, ReversalFigures] = MappingProxyType({}),
    caption: str | None = None,
) -> Table:
    """Return the table of the indicators at the reversals, um; in brackets, a reference's figures by feed."""
    radius_mm = results[0].radius_m * 1e3
    table = Table(
        title=f"Errors at the reversals, um, over {window_s * 1e3:.0f} ms, R = {radius_mm:g} mm",
        caption=caption,
    )
    table.add_column("F mm/min", justify="right")
    table.add_column("axis")
    for heading in HEADINGS:
        table.add_column(heading, justify="right")
    for result in results:
        for axis in AXES:
            published = reference.get(result.feed_mm_min) if axis == AXES[0] else None
            table.add_row(
                f"{result.feed_mm_min}" if axis == AXES[0] else "",
                axis,
                *_cells(figures_um(result.indicators[axis]), published),
                end_section=axis == AXES[-1],
            )
    return table


def _cells(ours: ReversalFigures, reference: ReversalFigures | None) -> list[str]:
    if reference is None:
        return [f"{value:.2f}" for value in ours]
    return [f"{value:.2f} ({theirs:.2f})" for value, theirs in zip(ours, reference, strict=True)]


def draw_circles(results: list[CircleResult], window_s: float, out: Path) -> list[Path]:
    """Draw the tracking errors at the reversals and the magnified contour; return the files."""
    reversals, contour = out / "reversals.png", out / "contour.png"
    plot_reversals(
        reversals, {axis: [result.error_traces[axis] for result in results] for axis in AXES}, window_s
    )
    plot_contour(contour, [result.contour for result in results], results[0].radius_m)
    return [reversals, contour]
