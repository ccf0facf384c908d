"""A tuning from the command line: its progress, summary, files and, if wanted, the changed machine file."""

import asyncio
import contextlib
from pathlib import Path

import typer
from pydantic import ValidationError
from rich.console import Console

from servo_ctrl.cli.progress import ignored, json_steps, progress_bar
from servo_ctrl.commands.local_messages import Requester
from servo_ctrl.config.load import load_machine
from servo_ctrl.daemon.run.report import Pacing
from servo_ctrl.tuning import simulated
from servo_ctrl.tuning.files import write_files
from servo_ctrl.tuning.machine_file import apply_to_file
from servo_ctrl.tuning.request import NOT_PROVED, STEPS, TuneRequest
from servo_ctrl.tuning.summary import summary_lines


def tune_and_report(
    machine: Path,
    axis: str,
    out: Path,
    ms: float,
    force_n: float | None,
    bus: str | None,
    controller: Path | None,
    who: str | None,
    pacing: Pacing,
    *,
    as_json: bool,
    apply: bool,
) -> None:
    """Tune an axis, print the summary, write the files, and apply proved values to the machine file.

    Raises ServoCtrlError, typer.BadParameter, and typer.Exit(1) where the proposal was not proved.
    """
    if bus is not None and controller is not None:
        raise typer.BadParameter("a controller has its own bus: leave --bus out", param_hint="--controller")
    requester = _requester(who)
    config, console = load_machine(machine), Console(stderr=True)

    def print_line(text: str) -> None:
        console.print(text, highlight=False, markup=False, soft_wrap=True)

    with contextlib.nullcontext(ignored) if as_json else progress_bar() as show:
        report_stage = json_steps(STEPS) if as_json else print_line
        request = TuneRequest(config, axis, out, ms, force_n, show, report_stage)
        if controller is None:
            result = asyncio.run(simulated.tune_axis(request, bus, pacing))
        else:
            result = asyncio.run(simulated.tune_by_controller(request, controller, requester))
    for line in summary_lines(result):
        typer.echo(line)
    for file in write_files(result, out):
        typer.echo(f"written: {file}")
    if not result.proved:
        typer.echo(f"servo-ctrl: {NOT_PROVED}", err=True)
        raise typer.Exit(1)
    if apply:
        kept = apply_to_file(config, axis, result.sections)
        typer.echo(f"applied: {config.source}; as it was: {kept}")


def _requester(who: str | None) -> Requester | None:
    """Parse --who. Raises typer.BadParameter."""
    try:
        return None if who is None else Requester.model_validate_json(who)
    except ValidationError:
        raise typer.BadParameter("expected user, role and address in JSON", param_hint="--who") from None
