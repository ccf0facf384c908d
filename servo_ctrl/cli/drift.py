"""`servo-ctrl experiment drift`: friction changes in production, the controller notices, and learns again."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from servo_ctrl.cli.figures_file import JsonOption, write_figures
from servo_ctrl.cli.options import LearnedOption, OutOption, TableOption  # noqa: TC001  # typer reads them
from servo_ctrl.experiment.friction_drift import AXIS, Drift, drift_figures, tell_story
from servo_ctrl.experiment.friction_twin import learn_in_twin
from servo_ctrl.telemetry.compensation_plots import EvaluationTrace, plot_evaluations


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
    or taken from --learned, where the new ones are stored too. Fails when the story goes otherwise.
    """
    console = Console()
    store = learned
    if store is None:
        store = out / "learned"
        with console.status("learning in the batch twin of the sound machine ..."):
            learn_in_twin(machine, store, "fast")

    def say(text: str) -> None:
        console.print(text, highlight=False)

    story = asyncio.run(
        tell_story(
            machine,
            plant or machine / "plant_lubrication_loss.toml",
            program or machine / "programs" / "production.toml",
            store,
            out,
            say,
        )
    )
    for line in story.heard:
        say(f"the controller's log: {line}")
    console.print(_table(story))
    picture = out / "drift.png"
    _draw(picture, story)
    say(f"picture: {picture}")
    write_figures(json_file, drift_figures(story))


def _table(story: Drift) -> Table:
    table = Table(title=f"J of axis {AXIS}, um; J_required {story.required_m * 1e6:g} um")
    for heading in ("production", "from", "median J", "J_required"):
        table.add_column(heading, justify="left" if heading == "production" else "right")
    begins_s = (0.0, story.instants.friction_changes_s, story.instants.learning_done_s)
    for begin_s, (name, evaluation_m) in zip(begins_s, story.parts_m().items(), strict=True):
        kept = evaluation_m <= story.required_m
        mark = "[green]kept[/green]" if kept else "[bold red]exceeded[/bold red]"
        table.add_row(name, f"{begin_s:.0f} s", f"{evaluation_m * 1e6:.2f}", mark)
    return table


def _draw(path: Path, story: Drift) -> None:
    at = story.instants
    axes = dict.fromkeys(entry["axis"] for entry in story.reversals)
    traces = []
    for axis in axes:
        entries = [entry for entry in story.reversals if entry["axis"] == axis]
        times_s = [float(entry["time_s"]) for entry in entries]
        traces.append(EvaluationTrace(f"axis {axis}", times_s, [entry["error_mean_m"] for entry in entries]))
    instants = {
        "friction changes": at.friction_changes_s,
        "learning is due": at.due_s,
        "due no more": at.due_cleared_s,
    }
    last_s = max(float(entry["time_s"]) for entry in story.reversals)
    parts = {
        "production, then the friction changes": (0.0, at.learning_begun_s),
        f"after learning axis {AXIS} over the bus": (at.learning_done_s, last_s),
    }
    plot_evaluations(path, traces, story.required_m, instants, parts)
