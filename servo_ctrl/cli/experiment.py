"""`servo-ctrl experiment`: simulated machines held against published and measured figures."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table

from servo_ctrl.cli.circle_report import draw_circles, error_table, indicator_table
from servo_ctrl.cli.compensations import compensations
from servo_ctrl.cli.drift import drift
from servo_ctrl.cli.figures_file import JsonOption, write_figures
from servo_ctrl.cli.friction import friction
from servo_ctrl.cli.fuzzy import fuzzy
from servo_ctrl.cli.options import OutOption, TableOption  # noqa: TC001  # typer reads them at run time
from servo_ctrl.cli.positioning import positioning
from servo_ctrl.cli.progress import progress_bar
from servo_ctrl.experiment import emps as emps_experiment
from servo_ctrl.experiment.circles import analyse_circles, summary
from servo_ctrl.experiment.simulated_run import simulated_run
from servo_ctrl.telemetry.plots import Comparison, plot_against_measurement

if TYPE_CHECKING:
    from servo_ctrl.experiment.emps import EmpsResult

app = typer.Typer(no_args_is_help=True)


@app.callback()
def experiments() -> None:
    """Hold simulated machines against published and measured figures, over the bus in lockstep."""


app.command()(friction)
app.command()(drift)
app.command()(fuzzy)
app.command()(positioning)
app.command()(compensations)


@app.command()
def circles(
    machine: TableOption = Path("machines/xy_table"),
    out: OutOption = Path("out/circles"),
    json_file: JsonOption = None,
) -> None:
    """Run circles R = 25 mm without compensation and report the errors against Feng et al. 2015, table 3."""
    with progress_bar() as show:
        run = asyncio.run(simulated_run(machine, machine / "programs" / "circles.toml", out, show))
    window_s = run.machine.monitoring.window_s
    results = analyse_circles(run.recording, window_s)
    figures = summary(results)
    console = Console()
    console.print(indicator_table(results, window_s))
    console.print(error_table(figures["published_x_relative_errors_percent"]))
    console.print(
        f"the sixteen relative errors of x: RMS {figures['relative_error_rms_percent']:.1f} %, "
        f"largest {figures['relative_error_largest_percent']:.1f} %",
        highlight=False,
    )
    draw_circles(results, window_s, out)
    write_figures(json_file, figures)


@app.command()
def emps(
    data: Annotated[Path, typer.Option(help="Directory with emps_train.npz and emps_test_pulses.npz.")],
    machine: Annotated[Path, typer.Option(help="Directory of the EMPS axis.")] = Path("machines/emps"),
    out: OutOption = Path("out/emps"),
    json_file: JsonOption = None,
) -> None:
    """Feed a real axis' recorded reference through the control law and the simulated axis, and compare.

    Both records are run, the one with pulses too. Errors are relative 2-norms against the real measurement.
    """
    table = Table(title="EMPS: simulated axis against the real one")
    for heading in ("record", "force error", "published", "position error", "RMS"):
        table.add_column(heading, justify="left" if heading == "record" else "right")
    figures = {}
    for record, published in emps_experiment.PUBLISHED_FORCE_ERROR_PERCENT.items():
        result = _run_record(data, machine, out, record)
        table.add_row(
            record,
            f"{result.force_error_percent:.2f} %",
            f"{published:.2f} %",
            f"{result.position_error_percent:.5f} %",
            f"{result.position_rms_um:.2f} um",
        )
        figures[record] = {
            "force_error_percent": result.force_error_percent,
            "force_error_with_start_percent": result.force_error_with_start_percent,
            "published_force_error_percent": published,
            "position_error_percent": result.position_error_percent,
            "position_rms_um": result.position_rms_um,
        }
    Console().print(table)
    write_figures(json_file, figures)


def _run_record(data: Path, machine: Path, out: Path, record: str) -> EmpsResult:
    """Run one record over the bus and draw it."""
    path = emps_experiment.record_path(data, record)
    measurement = emps_experiment.load_measurement(path)
    program = machine / "programs" / "reference.toml"
    with progress_bar() as show:
        run = asyncio.run(simulated_run(machine, program, out, show, {"recording": path}))
    result = emps_experiment.compare(run.recording, measurement)
    plot_against_measurement(
        out / f"{record}.png",
        result.time_s,
        [
            Comparison("force", "N", result.force_n, result.measured_force_n, "N", 1.0),
            Comparison("position", "m", result.position_m, result.measured_position_m, "um", 1e6),
        ],
        f"EMPS {record}: force error {result.force_error_percent:.2f} %",
    )
    return result
