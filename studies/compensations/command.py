"""`servo-ctrl experiment compensations`: the errors with each compensation on each machine."""

from pathlib import Path
from typing import Annotated

import typer

from servo_ctrl.cli.options import JsonOption, OutOption


def compensations(
    machine: Annotated[
        list[Path] | None, typer.Option(help="Directory of a machine; may be repeated. Default: all three.")
    ] = None,
    out: OutOption = Path("out/compensations"),
    json_file: JsonOption = None,
) -> None:
    """Measure every compensation alone and together, on every machine: sines and end points, in the twin.

    The controller closes all loops (CST), so that every compensation can act. Compensations that learn do so
    first, on other motions. Writes OUT/table.md, the table of docs/compensations.md.
    """
    from studies.compensations.run import run_compensations

    run_compensations(machine, out, json_file)
