"""`servo-ctrl`: the controller's command line. One file per subcommand; errors are one line."""

import sys
from typing import Annotated

import typer

from servo_ctrl.cli import experiment, learned
from servo_ctrl.cli.ask import ask, conformance, nodes
from servo_ctrl.cli.check import check
from servo_ctrl.cli.compile_kernels import compile_kernels
from servo_ctrl.cli.demo import demo
from servo_ctrl.cli.export import export
from servo_ctrl.cli.learn import learn
from servo_ctrl.cli.new_machine import new_machine
from servo_ctrl.cli.report import report
from servo_ctrl.cli.run import run
from servo_ctrl.cli.tune import tune
from servo_ctrl.errors import ServoCtrlError, reason_of
from shipped_files.plain_help import PlainCommand, PlainGroup

app = typer.Typer(
    name="servo-ctrl",
    no_args_is_help=True,
    cls=PlainGroup,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
)


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"servo-ctrl {version('servo-ctrl')}")
        raise typer.Exit


@app.callback()
def commands(
    _version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Servo controller for CANopen drives (CiA 402) and linear scales (CiA 406).

    First steps: `servo-ctrl check` checks a machine and a program, without a bus.
    `servo-ctrl run` boots the machine on a bus and runs the program, `servo-ctrl learn` has it learn its
    friction compensation and its screws, `servo-ctrl tune` measures an axis and proposes its gains.
    `servo-ctrl report` makes a page and a PDF of a recording, `servo-ctrl export` turns it into CSV.

    Without hardware: `servo-ctrl demo`, or `hil-sim run --machine DIR --bus localcan:/tmp/table.sock` beside
    `servo-ctrl run --machine DIR --bus localcan:/tmp/table.sock --pacing lockstep --hmi 127.0.0.1:8080`.
    In lockstep nothing is late however busy the computer is; real time is for drives on a real bus, and for
    a quiet computer.
    """


for _command in (run, learn, tune, check, export, report, demo, ask, new_machine, nodes, conformance):
    app.command(cls=PlainCommand)(_command)
app.command("compile", cls=PlainCommand, hidden=True)(compile_kernels)
app.add_typer(experiment.app, name="experiment")
app.add_typer(learned.app, name="learned")


def main() -> None:
    """Run the command line; an error is one line on standard error."""
    try:
        app()
    except ServoCtrlError as error:
        typer.echo(f"servo-ctrl: {error}", err=True)
        sys.exit(error.exit_status)
    except OSError as error:
        if error.filename is None:
            raise
        typer.echo(f"servo-ctrl: {error.filename}: cannot be used: {reason_of(error)}", err=True)
        sys.exit(1)


if __name__ == "__main__":
    main()
