"""`hil-sim`: the simulator's command line. One subcommand a file."""

from typing import Annotated

import typer

from hil_sim.cli.compile_kernels import compile_kernels
from hil_sim.cli.run import run
from shipped_files.plain_help import PlainCommand, PlainGroup

app = typer.Typer(name="hil-sim", no_args_is_help=True, cls=PlainGroup, add_completion=True)


def _show_version(requested: bool) -> None:
    if requested:
        from importlib.metadata import version

        typer.echo(f"hil-sim {version('servo-ctrl')}")
        raise typer.Exit


@app.callback()
def commands(
    _version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit."),
    ] = False,
) -> None:
    """Hardware-in-the-loop bench: servo drives (CiA 402) and linear scales (CiA 406) on a CAN bus."""


app.command(cls=PlainCommand)(run)
app.command("compile", hidden=True)(compile_kernels)


def main() -> None:
    """Entry point of the console script."""
    app()


if __name__ == "__main__":
    main()
