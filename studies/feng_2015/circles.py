"""Circles of the simulated table against Feng et al. 2015, table 3, without compensation."""

from typing import Any

import numpy as np
from rich.table import Table

from servo_ctrl.cli.circle_report import HEADINGS
from servo_ctrl.metrology.circles import AXES, CircleResult, figures_um
from studies.feng_2015.published import relative_errors_percent


def summary(results: list[CircleResult]) -> dict[str, Any]:
    """Everything measured, and the x axis' relative errors against the published figures, for JSON."""
    measured = {result.feed_mm_min: figures_um(result.indicators["x"]) for result in results}
    errors = relative_errors_percent(measured)
    every = [value for figures in errors.values() for value in figures]
    return {
        "circles": [
            {
                "label": result.label,
                "feed_mm_min": result.feed_mm_min,
                "radius_mm": result.radius_m * 1e3,
                "axes": {axis: figures_um(result.indicators[axis])._asdict() for axis in AXES},
            }
            for result in results
        ],
        "published_x_relative_errors_percent": {feed: row._asdict() for feed, row in errors.items()},
        "relative_error_rms_percent": float(np.sqrt(np.mean(np.square(every)))) if every else None,
        "relative_error_largest_percent": max(every, key=abs) if every else None,
    }


def error_table(errors: dict[int, dict[str, float]]) -> Table:
    """Relative errors of the x axis' indicators against the published ones, per cent, by feed (mm/min)."""
    table = Table(title="x axis against the published figures: relative errors, %")
    table.add_column("F mm/min", justify="right")
    for heading in HEADINGS:
        table.add_column(heading, justify="right")
    for feed, row in errors.items():
        table.add_row(str(feed), *(f"{error:+.1f}" for error in row.values()))
    return table
