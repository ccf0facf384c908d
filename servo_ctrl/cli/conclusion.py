"""Outcome of a run as lines and as an exit status, for all commands that make a run."""

import typer

from servo_ctrl.cli.part_program_report import print_contour_error
from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.program_model import ProgramConfig
from servo_ctrl.daemon.run.report import RunReport
from servo_ctrl.daemon.run.stop_signals import exit_status_after
from servo_ctrl.learning.screw import LEARNER as SCREW
from servo_ctrl.learning.screw import ScrewLearned
from servo_ctrl.recording.recorder import RecordingError


def conclude(config: MachineConfig, report: RunReport, program: ProgramConfig | None = None) -> None:
    """Print the outcome of a run and exit accordingly. `progress` has printed its events already."""
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
                print_contour_error(config, program, report.recording)
            except RecordingError:
                if not report.failed:  # after a failure, the reason names what could not be written
                    raise
    if report.failed or report.signal:
        typer.echo(f"servo-ctrl: {report.reason}", err=True)
        raise typer.Exit(1 if report.failed else exit_status_after(report.signal))


def print_learned(report: RunReport, *, resumable: bool) -> None:
    """Print what was learned, one line per axis, and how to continue unfinished learning."""
    for outcome in report.outcomes:
        learned = outcome.learned
        made = f"{learned.strokes} {'travels' if learned.learner == SCREW else 'strokes'}"
        if outcome.resumed:
            made += f" ({outcome.resumed} of an earlier run)"
        typer.echo(
            f"axis {outcome.axis}: J {learned.before_m * 1e6:.2f} um -> {learned.after_m * 1e6:.2f} um, "
            f"{made}, {learned.machine_time_s / 60.0:.1f} min of motion, version {outcome.version}"
        )
        if isinstance(learned, ScrewLearned):
            typer.echo(
                f"axis {outcome.axis}: lost motion {learned.lost_motion_m * 1e6:.2f} um, "
                f"{len(learned.points)} nodes, spread {learned.spread_m * 1e6:.3f} um from travel to travel"
            )
    unfinished = report.learning.planned and report.learning.stage != "done"
    if resumable and report.learning.state is LearningState.FAILED and unfinished:
        typer.echo(
            f"axis {report.learning.axis} is not learned; the strokes made so far are kept: "
            "run the same command again to go on",
            err=True,
        )
