"""`servo-ctrl experiment drift`: friction changes in production; the controller learns again."""

from pathlib import Path
from typing import Annotated

import typer

from servo_ctrl.cli.options import JsonOption, LearnedOption, OutOption, TableOption


def drift(
    machine: TableOption = Path("machines/xy_table"),
    plant: Annotated[
        Path | None,
        typer.Option(help="Plant file whose friction changes; default plant_lubrication_loss.toml."),
    ] = None,
    program: Annotated[
        Path | None, typer.Option(help="What is produced; default programs/production.toml.")
    ] = None,
    learned: LearnedOption = None,
    out: OutOption = Path("out/drift"),
    json_file: JsonOption = None,
) -> None:
    """Produce with learned compensation while the x axis loses its lubrication, over the bus in lockstep.

    J rises above J_required, the status PDO says that learning is due, learning is started by SDO, and J is
    below J_required again. The functions at the start are learned in the batch twin of the sound machine,
    or taken from --learned, where the new ones are stored too. Fails when one of these does not happen.
    """
    from studies.feng_2015.drift_run import drift_study

    drift_study(machine, plant=plant, program=program, learned=learned, out=out, json_file=json_file)
