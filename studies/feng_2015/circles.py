"""`servo-ctrl experiment circles`: circles of the simulated table against Feng et al. 2015, table 3."""

import asyncio
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.markdown import Markdown

from kernels.arrays import rms
from servo_ctrl.cli.circle_report import draw_circles, indicator_table
from servo_ctrl.cli.figures_file import write_figures
from servo_ctrl.cli.progress import progress_bar
from servo_ctrl.hil_rig.simulated_run import simulated_run
from servo_ctrl.metrology.circles import AXES, CircleResult, analyse_circles, figures_um
from studies.feng_2015.published import FENG_2015_X_UNCOMPENSATED, relative_errors_percent
from studies.feng_2015.study_tables import INDICATORS
from studies.markdown_table import markdown_table, titled

CAPTION = "in brackets: Feng et al. 2015, table 3, without compensation"


def run_circles(machine: Path, out: Path, json_file: Path | None) -> None:
    """Run circles R = 25 mm without compensation and report the errors against Feng et al. 2015, table 3."""
    with progress_bar() as show:
        run = asyncio.run(simulated_run(machine, machine / "programs" / "circles.toml", out, show))
    window_s = run.machine.monitoring.window_s
    results = analyse_circles(run.recording, window_s)
    figures = summary(results)
    errors = figures["published_x_relative_errors_percent"]
    console = Console()
    console.print(indicator_table(results, window_s, FENG_2015_X_UNCOMPENSATED, CAPTION))
    console.print(error_table(errors))
    console.print(
        f"the {sum(map(len, errors.values()))} relative errors of x: "
        f"RMS {figures['relative_error_rms_percent']:.1f} %, "
        f"largest {figures['relative_error_largest_percent']:.1f} %",
        highlight=False,
    )
    draw_circles(results, window_s, out)
    write_figures(json_file, figures)


def summary(results: list[CircleResult]) -> dict[str, Any]:
    """Return all figures, and the relative errors of the x axis against the published ones, for JSON."""
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
        "relative_error_rms_percent": rms(np.array(every)) if every else None,
        "relative_error_largest_percent": max(every, key=abs) if every else None,
    }


def error_table(errors: dict[int, dict[str, float]]) -> Markdown:
    """Return the relative errors (%) of the indicators of x against the published ones, by feed (mm/min)."""
    rows = [(str(feed), *(f"{error:+.1f}" for error in row.values())) for feed, row in errors.items()]
    title = "x axis against the published figures: relative errors, %"
    return titled(title, markdown_table(("F mm/min", *INDICATORS), rows))
