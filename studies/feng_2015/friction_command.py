"""`servo-ctrl experiment friction`: the friction study of Feng et al. 2015 on the simulated table."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from servo_ctrl.cli.options import JsonOption, OutOption, TableOption

SEED = 2015
"""Default seed of the random commands; chosen."""


class LearnChoice(StrEnum):
    """How the compared functions are learned."""

    TWIN = "twin"
    BUS = "bus"


def friction(
    machine: TableOption = Path("machines/xy_table"),
    out: OutOption = Path("out/friction"),
    json_file: JsonOption = None,
    learn: Annotated[
        LearnChoice,
        typer.Option(
            help="twin: compare the functions that the paper's learner found in the batch twin. bus: learn "
            "with the fast learner over the bus too, and compare those."
        ),
    ] = LearnChoice.TWIN,
    strokes: Annotated[
        int, typer.Option(min=0, max=100, help="Strokes of the twin to repeat over the bus, of each axis.")
    ] = 6,
    seed: Annotated[int, typer.Option(min=0, help="Of the random draw of these strokes.")] = SEED,
) -> None:
    """Learn the friction compensation and compare it with Feng et al. 2015: tables, pictures, JSON.

    Runs circles of R = 25 mm at four feeds and the S-shaped motions S1-S4 over the bus in lockstep, without
    compensation (WTFC), with the disturbance observer (WDOB) and with the learned pulse (WFC); WFC_single is
    the pulse without the second trapezoid. Learning uses sines of R = 50 mm only. Fails when a run fails;
    prints a missed bar in red.
    """
    from studies.feng_2015.friction_run import friction_study

    friction_study(machine, out, json_file, strokes, seed, over_bus=learn is LearnChoice.BUS)
