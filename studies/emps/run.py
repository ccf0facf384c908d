"""`servo-ctrl experiment emps`: records of a real axis compared with the simulated axis."""

import asyncio
from pathlib import Path

from rich.console import Console

from servo_ctrl.cli.figures_file import write_figures
from servo_ctrl.cli.progress import progress_bar
from servo_ctrl.hil_rig.simulated_run import simulated_run
from servo_ctrl.plots.figures import Comparison, plot_against_measurement
from studies.emps import comparison
from studies.emps.comparison import EmpsResult
from studies.markdown_table import markdown_table, titled


def run_emps(data: Path, machine: Path, out: Path, json_file: Path | None) -> None:
    """Run the recorded reference of a real axis with the control law on the simulated axis, and compare."""
    rows, figures = [], {}
    for record, published in comparison.PUBLISHED_FORCE_ERROR_PERCENT.items():
        result = _run_record(data, machine, out, record)
        errors = (f"{result.force_error_percent:.2f} %", f"{published:.2f} %")
        rows.append(
            (record, *errors, f"{result.position_error_percent:.5f} %", f"{result.position_rms_um:.2f} um")
        )
        figures[record] = {
            "force_error_percent": result.force_error_percent,
            "force_error_with_start_percent": result.force_error_with_start_percent,
            "published_force_error_percent": published,
            "position_error_percent": result.position_error_percent,
            "position_rms_um": result.position_rms_um,
        }
    heads = ("record", "force error", "published", "position error", "RMS")
    Console().print(titled("EMPS: simulated axis against the real one", markdown_table(heads, rows)))
    write_figures(json_file, figures)


def _run_record(data: Path, machine: Path, out: Path, record: str) -> EmpsResult:
    """Run one record over the bus and draw it."""
    path = comparison.record_path(data, record)
    measurement = comparison.load_measurement(path)
    program = machine / "programs" / "reference.toml"
    with progress_bar() as show:
        run = asyncio.run(simulated_run(machine, program, out, show, {"recording": path}))
    result = comparison.compare(run.recording, measurement)
    plot_against_measurement(
        out / f"{record}.png",
        result.time_s,
        [
            Comparison(
                quantity="force",
                unit="N",
                simulated=result.force_n,
                measured=result.measured_force_n,
                difference_unit="N",
                difference_factor=1.0,
            ),
            Comparison(
                quantity="position",
                unit="m",
                simulated=result.position_m,
                measured=result.measured_position_m,
                difference_unit="um",
                difference_factor=1e6,
            ),
        ],
        f"EMPS {record}: force error {result.force_error_percent:.2f} %",
    )
    return result
