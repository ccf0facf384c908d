"""`hil-sim`: the simulator's command line. One subcommand a file."""

import typer

from hil_sim.cli.compile_kernels import compile_kernels
from hil_sim.cli.run import run

app = typer.Typer(name="hil-sim", no_args_is_help=True, add_completion=False)


@app.callback()
def commands() -> None:
    """Hardware-in-the-loop bench: servo drives (CiA 402) and linear scales (CiA 406) on a CAN bus."""


app.command()(run)
app.command("compile", hidden=True)(compile_kernels)


def main() -> None:
    """Entry point of the console script."""
    app()


if __name__ == "__main__":
    main()
