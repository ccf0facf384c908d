"""How a run has gone, in lines and in an exit status; the same for all commands that make one."""

from __future__ import annotations

import signal
from typing import TYPE_CHECKING

import typer

from servo_ctrl.cli.part_program_report import show_contour_error
from servo_ctrl.telemetry.recorder import RecordingError

if TYPE_CHECKING:
    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.config.program_model import ProgramConfig
    from servo_ctrl.daemon.report import RunReport


def conclude(config: MachineConfig, report: RunReport, program: ProgramConfig | None = None) -> None:
    """Say how it went and exit accordingly. The events were told as they happened (`cli.progress`)."""
    rate_1_s = report.cycles / report.wall_s if report.wall_s > 0.0 else 0.0
    summary = (
        f"{report.cycles} cycles, {report.cycles * config.period_s:.2f} s of machine time in "
        f"{report.wall_s:.2f} s ({rate_1_s:.0f} cycles/s)"
    )
    if report.lateness is not None:
        p50, p99, p999 = (report.lateness.percentile_us(share) for share in (0.5, 0.99, 0.999))
        summary += (
            f", ticks late by {p50:.0f}/{p99:.0f}/{p999:.0f} us (p50/p99/p99.9), {report.missed_ticks} missed"
        )
    typer.echo(f"{report.machine}: {summary}")
    if report.recording is not None:
        typer.echo(f"recording: {report.recording}")
        if report.completed:
            try:
                show_contour_error(config, program, report.recording)
            except RecordingError:
                if not report.failed:  # else the reason tells what could not be written
                    raise
    if report.failed:
        typer.echo(f"servo-ctrl: {report.reason}", err=True)
        raise typer.Exit(1)
    if report.signal:
        typer.echo(f"servo-ctrl: {report.reason}", err=True)
        raise typer.Exit(128 + signal.Signals[report.signal].value)
