"""Progress of a diagnosis: a bar, a line per step, or a line of JSON per step for another program."""

import contextlib
from collections.abc import Callable, Iterator, Sequence

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from servo_ctrl.files.progress_line import progress_line

DONE = "done"
"""Name of the step that ends a diagnosis, in a line of JSON."""


def steps_of(axes: Sequence[str]) -> list[str]:
    """Return the steps that `reconcile.diagnosis.diagnose` may report, in order; it may omit some."""
    by_axis = [f"axis {axis}: {step}" for axis in axes for step in ("force", "scale less motor", "proof")]
    return ["reading", "checking timing and sensors", *by_axis, "replaying", "locating", "report"]


def json_line(step: str, steps: Sequence[str]) -> str:
    """Return a line of JSON: `step` begins, `done` of `of` steps have ended or were omitted."""
    done = len(steps) if step == DONE else steps.index(step) if step in steps else 0
    return progress_line(step, done, len(steps))


@contextlib.contextmanager
def show_progress(steps: Sequence[str], *, as_json: bool) -> Iterator[Callable[[str], None]]:
    """Yield a function that reports each step as it begins, on standard error; a bar on a terminal."""
    if as_json:
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
