"""`servo-ctrl experiment fuzzy`: PID against fuzzy-PD on a table with friction and backlash."""

from pathlib import Path
from typing import Annotated

import typer

from servo_ctrl.cli.options import JsonOption, OutOption
from shipped_files import shipped


def fuzzy(
    machine: Annotated[
        Path,
        typer.Option(help="Directory of the table, with the machine files of both laws.", callback=shipped),
    ] = Path("machines/fuzzy_table"),
    out: OutOption = Path("out/fuzzy"),
    json_file: JsonOption = None,
) -> None:
    """Run a velocity step, position steps and a sine (Xia et al., figures 6-8) with PID and with fuzzy-PD.

    Runs over the bus in lockstep; both laws were tuned by the same procedure on other motions
    (docs/fuzzy_pd.md). Prints the figures, draws the pictures. Fails when a run fails; prints a missed bar
    in red.
    """
    from studies.xia_fuzzy_pd.run import run_fuzzy

    run_fuzzy(machine, out, json_file)
