"""`servo-ctrl experiment friction`: the friction study of Feng et al. 2015 on the simulated table."""

from __future__ import annotations

import asyncio
import time
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from servo_ctrl.cli.figures_file import JsonOption, write_figures
from servo_ctrl.cli.friction_pictures import draw_study
from servo_ctrl.cli.friction_report import print_study
from servo_ctrl.cli.options import OutOption, TableOption  # noqa: TC001  # typer reads them at run time
from servo_ctrl.cli.progress import progress_bar
from servo_ctrl.experiment.friction_bus import learn_over_bus
from servo_ctrl.experiment.friction_strokes import drawn, repeat_strokes
from servo_ctrl.experiment.friction_study import Study, summary
from servo_ctrl.experiment.friction_twin import learn_in_twin
from servo_ctrl.experiment.friction_variants import run_variant, variants, without_second_trapezoid

if TYPE_CHECKING:
    from servo_ctrl.experiment.friction_bus import BusLearning
    from servo_ctrl.experiment.friction_strokes import RepeatedStroke
    from servo_ctrl.experiment.friction_twin import TwinLearning, TwinStroke
    from servo_ctrl.experiment.friction_variants import VariantResult

SEED = 2015


class LearnChoice(StrEnum):
    """Where the functions that are judged come from."""

    TWIN = "twin"
    BUS = "bus"


def friction(
    machine: TableOption = Path("machines/xy_table"),
    out: OutOption = Path("out/friction"),
    json_file: JsonOption = None,
    learn: Annotated[
        LearnChoice,
        typer.Option(
            help="twin: judge what the paper's learner found in the batch twin. bus: let the fast learner "
            "learn over the bus too, and judge that."
        ),
    ] = LearnChoice.TWIN,
    strokes: Annotated[
        int, typer.Option(min=0, max=100, help="Strokes of the twin to repeat over the bus, of each axis.")
    ] = 6,
    seed: Annotated[int, typer.Option(min=0, help="Of the lots that choose them.")] = SEED,
) -> None:
    """Learn the friction compensation, and hold it against Feng et al. 2015: tables, pictures, JSON.

    Circles of R = 25 mm at four feeds and the S-shaped motions S1-S4 are run over the bus in lockstep without
    compensation (WTFC), with the disturbance observer (WDOB) and with the learned pulse (WFC); WFC_single is
    the pulse without the second trapezoid. Learning has seen sines of R = 50 mm only. Fails when a run fails;
    a bar that is missed is printed in red.
    """
    begun_s = time.monotonic()
    console = Console()
    paper = _learn_in_twin(console, machine, out, "paper")
    fast = _learn_in_twin(console, machine, out, "fast")
    repeated = _repeat(console, machine, out, drawn(paper, strokes, seed))
    bus = _learn_over_bus(console, machine, out) if learn is LearnChoice.BUS else None
    judged, single = (paper.store if bus is None else bus.store), out / "learned" / "single"
    without_second_trapezoid(machine, judged, single)
    results = _run_variants(console, machine, out, judged, single)
    study = Study(results, paper, fast, repeated, seed, bus, time.monotonic() - begun_s)
    print_study(console, study)
    for picture in draw_study(machine, study, out):
        console.print(f"picture: {picture}", highlight=False)
    write_figures(json_file, summary(study))


def _learn_in_twin(console: Console, machine: Path, out: Path, learner: str) -> TwinLearning:
    said = f"learning in the batch twin, {learner} learner"
    with console.status(f"{said} ..."):
        twin = learn_in_twin(machine, out / "learned" / learner, learner)
    made = sum(axis.learned.strokes for axis in twin.axes.values())
    console.print(f"{said}: {made} strokes in {twin.wall_s:.0f} s", highlight=False)
    return twin


def _repeat(
    console: Console, machine: Path, out: Path, strokes: dict[str, list[TwinStroke]]
) -> list[RepeatedStroke]:
    console.print("some of its strokes over the bus ...")
    with progress_bar() as show:
        return asyncio.run(repeat_strokes(machine, strokes, out, show))


def _learn_over_bus(console: Console, machine: Path, out: Path) -> BusLearning:
    console.print("learning over the bus, fast learner ...")
    with progress_bar() as show:
        return asyncio.run(learn_over_bus(machine, out / "learned" / "bus", "fast", show))


def _run_variants(
    console: Console, machine: Path, out: Path, learned: Path, single: Path
) -> dict[str, VariantResult]:
    results = {}
    for variant in variants(learned, single):
        console.print(f"circles and S-shaped motions over the bus: {variant.name} ...")
        with progress_bar() as show:
            results[variant.name] = asyncio.run(run_variant(machine, variant, out, show))
    return results
