"""Progress and events of a run on standard error: a bar on a terminal, else a line for each step."""

import contextlib
import itertools
import math
from collections.abc import Callable, Iterator

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

from servo_ctrl.commands.learning_status import ACTIVE
from servo_ctrl.daemon.run.report import Progress as RunProgress
from servo_ctrl.files.progress_line import progress_line

Show = Callable[[RunProgress], None]


@contextlib.contextmanager
def progress_bar() -> Iterator[Show]:
    """Yield the `on_progress` of `run_machine`; each event is printed once, as it happens."""
    console, printed = Console(stderr=True), 0
    with _bar(console) if console.is_terminal else contextlib.nullcontext(_lines(console)) as show_step:

        def show(progress: RunProgress) -> None:
            nonlocal printed
            missed = progress.events_count - printed - len(progress.events)
            printed = progress.events_count
            lines = [f"{missed} more events"] if missed > 0 else []
            for line in (*lines, *progress.events[max(-missed, 0) :]):
                console.print(f"servo-ctrl: {line}", highlight=False, markup=False, soft_wrap=True)
            show_step(progress)

        yield show


def ignored(_progress: RunProgress) -> None:
    """Show nothing."""


def json_steps(usual: int) -> Callable[[str], None]:
    """Return what prints a line of JSON on standard error for each step: step, done, of.

    `usual`: number of steps; where there are more, the last one takes them all.
    """
    counted = itertools.count()

    def print_step(step: str) -> None:
        typer.echo(progress_line(step, min(next(counted), usual - 1), usual), err=True)

    return print_step


@contextlib.contextmanager
def _bar(console: Console) -> Iterator[Show]:
    with Progress(
        TextColumn("{task.fields[stage]}"),
        TextColumn("[bold]{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TextColumn("{task.fields[time_s]:.1f} s"),
        console=console,
    ) as bar:
        task = bar.add_task("", total=1.0, stage="booting", time_s=0.0)
        yield lambda progress: bar.update(
            task,
            completed=progress.done,
            description=_label(progress),
            stage=progress.stage.words,
            time_s=progress.time_s,
        )


def _lines(console: Console) -> Show:
    """Print a line whenever the stage or the step changes, for a log."""
    printed = ""

    def show(progress: RunProgress) -> None:
        nonlocal printed
        now = f"{progress.stage.words}: {_label(progress)}"
        if now != printed:
            printed = now
            share = f"({progress.time_s:.1f} s, {100.0 * progress.done:.0f} %)"
            console.print(f"{now} {share}", highlight=False, soft_wrap=True)

    return show


def _label(progress: RunProgress) -> str:
    """Return the program's step; while an axis learns, its stroke, the remaining time and the best J."""
    learning = progress.learning
    if not learning.planned or learning.state not in ACTIVE:
        return progress.label
    remaining_s = learning.remaining_s
    remaining = f"{remaining_s:.0f} s" if remaining_s < 120.0 else f"{remaining_s / 60.0:.0f} min"
    at = f" at {learning.acceleration_m_s2 * 1e3:.3g} mm/s^2"
    text = (
        f"axis {learning.axis}: {learning.stage}{'' if math.isnan(learning.acceleration_m_s2) else at}, "
        f"stroke {learning.strokes_done + 1} of {learning.strokes_total}, {remaining} left"
    )
    return text if math.isnan(learning.best_m) else f"{text}, best J {learning.best_m * 1e6:.2f} um"
