"""How far a diagnosis is: a bar, a line each, or a line of JSON each for a program that reads it."""

from __future__ import annotations

import contextlib
import json
from enum import StrEnum
from typing import TYPE_CHECKING

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

FORMAT = 1
DONE = "done"


class Told(StrEnum):
    """`--progress`."""

    WORDS = "words"
    JSON = "json"


def steps_of(axes: Sequence[str]) -> list[str]:
    """What `reconcile.diagnose` may say it does, in order; a step may be left out."""
    of_axes = [f"axis {axis}: {sense}" for axis in axes for sense in ("force", "scale less motor")]
    return ["reading", "checking timing and sensors", *of_axes, "replaying", "locating", "report"]


def json_line(step: str, steps: Sequence[str]) -> str:
    """`step` begins, `done` of `of` are over; a step that was left out counts as over."""
    done = len(steps) if step == DONE else steps.index(step) if step in steps else 0
    return json.dumps({"format": FORMAT, "step": step, "done": done, "of": len(steps)})


@contextlib.contextmanager
def progress(steps: Sequence[str], told: Told) -> Iterator[Callable[[str], None]]:
    """Takes each step as it begins; all on standard error. In words: a bar where that is a terminal."""
    if told is Told.JSON:
        yield lambda step: typer.echo(json_line(step, steps), err=True)
        typer.echo(json_line(DONE, steps), err=True)
        return
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda step: console.print(step, highlight=False, markup=False, soft_wrap=True)
        return
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("reading", total=len(steps))
        yield lambda step: bar.update(
            task, description=step, completed=steps.index(step) if step in steps else None
        )
        bar.update(task, completed=len(steps))
