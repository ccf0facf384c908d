"""`servo-ctrl experiment positioning`: the positioning study of Wang et al. 2014 on the precision stage."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from servo_ctrl.cli.options import JsonOption, OutOption
from shipped_files import shipped
from studies.wang_2014.stages import STAGES, TARGETS

StageChoice = StrEnum("StageChoice", list(STAGES))  # type: ignore[misc]  # `stages` names them


def positioning(
    machine: Annotated[
        Path,
        typer.Option(
            help="Directory of the stage with its controller files and plant.toml.", callback=shipped
        ),
    ] = Path("machines/precision_stage"),
    out: OutOption = Path("out/positioning"),
    json_file: JsonOption = None,
    runs: Annotated[int, typer.Option(min=2, max=1000, help="Repeats of every series.")] = 100,
    points: Annotated[int, typer.Option(min=2, max=TARGETS, help="Targets over the travel.")] = TARGETS,
    stage: Annotated[
        list[StageChoice] | None, typer.Option(help="Run this stage only; may be repeated.")
    ] = None,
    bus_points: Annotated[
        int, typer.Option(min=0, max=20, help="Targets of the short study over the bus; 0 = none.")
    ] = 3,
    bus_runs: Annotated[int, typer.Option(min=1, max=100, help="Its repeats.")] = 2,
) -> None:
    """Position from both sides, 100 times, without and with each compensation: tables, pictures, JSON.

    The stages are those of Wang et al. 2014 (uncompensated, open loop with one-sided approach, sampled dual
    loop, smoothed) and the alternatives: screw table, continuous dual loop. The batch twin runs them all; a
    short series over the bus in lockstep must give the same readings. Fails when a run fails; prints a missed
    bar in red.
    """
    from studies.wang_2014.run import run_positioning

    run_positioning(
        machine,
        out,
        json_file,
        runs=runs,
        points=points,
        only=stage,
        bus_points=bus_points,
        bus_runs=bus_runs,
    )
