"""`reconcile`: finds physics that a simulation lacks. One subcommand per file; errors are one line."""

import os
import sys
from typing import Annotated

import typer

from reconcile.cli.diagnose import diagnose
from reconcile.cli.example import example
from reconcile.cli.fleet import fleet
from reconcile.cli.loop import loop
from reconcile.cli.trial import trial
from reconcile.cli.watch import watch
from reconcile.errors import ReconcileError
from servo_ctrl.errors import reason_of
from shipped_files.plain_help import PlainCommand, PlainGroup

app = typer.Typer(
    name="reconcile",
    no_args_is_help=True,
    cls=PlainGroup,
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
)


def _print_version(is_asked: bool) -> None:
    if is_asked:
        from importlib.metadata import version

        typer.echo(f"reconcile {version('servo-ctrl')}")
        raise typer.Exit


@app.callback()
def reconcile(
    _version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Find the physics that a simulation left out, from recordings that disagree with it.

    Exit codes: 0 done and written, whatever the verdict; 1 a file cannot be used, and standard error says
    which, where and why; 2 wrong use of the command; 130 interrupted, nothing half written.
    """


ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""The linear systems here are small: threads of linear algebra would wait for each other, for half as much
processor time again. Values set by the user stay.
"""

for _command in (diagnose, example, loop, trial, watch, fleet):
    app.command(cls=PlainCommand)(_command)


def main() -> None:
    """Entry point of the console script."""
    for name, count in ONE_THREAD.items():
        os.environ.setdefault(name, count)  # NumPy, which reads them, is imported by the commands
    try:
        app()
    except ReconcileError as error:
        typer.echo(f"reconcile: {error}", err=True)
        sys.exit(1)
    except OSError as error:
        if error.filename is None:
            raise
        typer.echo(f"reconcile: {error.filename}: cannot be used: {reason_of(error)}", err=True)
        sys.exit(1)


if __name__ == "__main__":
    main()
