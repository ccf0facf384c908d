"""`servo-ctrl experiment emps`: records of a real axis compared with the simulated axis."""

from pathlib import Path
from typing import Annotated

import typer

from servo_ctrl.cli.options import JsonOption, OutOption
from shipped_files import shipped


def emps(
    data: Annotated[Path, typer.Option(help="Directory with emps_train.npz and emps_test_pulses.npz.")],
    machine: Annotated[Path, typer.Option(help="Directory of the EMPS axis.", callback=shipped)] = Path(
        "machines/emps"
    ),
    out: OutOption = Path("out/emps"),
    json_file: JsonOption = None,
) -> None:
    """Run the recorded reference of a real axis with the control law on the simulated axis, and compare.

    Runs both records, also the one with pulses. Errors are relative 2-norms against the real measurement.
    """
    from studies.emps.run import run_emps

    run_emps(data, machine, out, json_file)
