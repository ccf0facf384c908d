"""`servo-ctrl new-machine`: a machine directory of one's own, copied from one that comes with the program."""

from pathlib import Path
from typing import Annotated

import typer


def new_machine(
    directory: Annotated[Path, typer.Argument(help="Directory to be made; must not exist yet.")],
    source: Annotated[
        str, typer.Option("--from", metavar="NAME", help="Machine that comes with the program.")
    ] = "xy_table",
) -> None:
    """Copy a machine with its programs and EDS files to a directory where its files can be changed.

    What was learned on the original is not taken along: it belongs to that machine.

    Example:  servo-ctrl new-machine my_table --from xy_table
    """
    from servo_ctrl.config.machine_copy import copy_machine

    copy_machine(source, directory)
    typer.echo(f"{directory}: a copy of {source}; next: servo-ctrl check --machine {directory}")
