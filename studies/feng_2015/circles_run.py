"""`servo-ctrl experiment circles`: the table's circles against the published errors."""

import asyncio
from pathlib import Path

from rich.console import Console

from servo_ctrl.cli.circle_report import draw_circles, indicator_table
from servo_ctrl.cli.figures_file import write_figures
from servo_ctrl.cli.progress import progress_bar
from servo_ctrl.hil_rig.simulated_run import simulated_run
from servo_ctrl.metrology.circles import analyse_circles
from studies.feng_2015.circles import error_table, summary
from studies.feng_2015.published import FENG_2015_X_UNCOMPENSATED

CAPTION = "in brackets: Feng et al. 2015, table 3, without compensation"


def run_circles(machine: Path, out: Path, json_file: Path | None) -> None:
    """Run circles R = 25 mm without compensation and report the errors against Feng et al. 2015, table 3."""
    with progress_bar() as show:
        run = asyncio.run(simulated_run(machine, machine / "programs" / "circles.toml", out, show))
    window_s = run.machine.monitoring.window_s
    results = analyse_circles(run.recording, window_s)
    figures = summary(results)
    console = Console()
    console.print(indicator_table(results, window_s, FENG_2015_X_UNCOMPENSATED, CAPTION))
    console.print(error_table(figures["published_x_relative_errors_percent"]))
    console.print(
        f"the sixteen relative errors of x: RMS {figures['relative_error_rms_percent']:.1f} %, "
        f"largest {figures['relative_error_largest_percent']:.1f} %",
        highlight=False,
    )
    draw_circles(results, window_s, out)
    write_figures(json_file, figures)
