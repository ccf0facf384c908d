"""Progress and events of a run on standard error: a bar on a terminal, else a line for each step."""

import contextlib
import math
from collections.abc import Callable, Iterator

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

from servo_ctrl.commands.learning_status import ACTIVE
from servo_ctrl.daemon.run.report import Progress as RunProgress


@contextlib.contextmanager
def progress_bar() -> Iterator[Callable[[RunProgress], None]]:
    """Yield the `on_progress` of `run_machine`."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield _ProgressLines(console)
        return
    with Progress(
        TextColumn("{task.fields[stage]}"),
        TextColumn("[bold]{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TextColumn("{task.fields[time_s]:.1f} s"),
        console=console,
    ) as bar:
        task = bar.add_task("", total=1.0, stage="booting", time_s=0.0)
        events = _EventLines(console)

        def show(progress: RunProgress) -> None:
            events(progress)
            bar.update(
                task,
                completed=progress.done,
                description=_label(progress),
                stage=progress.stage.words,
                time_s=progress.time_s,
            )

        yield show


class _EventLines:
    """Prints each event once, as it happens."""

    def __init__(self, console: Console) -> None:
        self._console, self._printed_count = console, 0

    def __call__(self, progress: RunProgress) -> None:
        new = progress.events_count - self._printed_count
        self._printed_count = progress.events_count
        missed = new - len(progress.events)
        lines = [f"{missed} more events"] if missed > 0 else []
        for line in (*lines, *progress.events[max(-missed, 0) :]):
            self._console.print(f"servo-ctrl: {line}", highlight=False, markup=False, soft_wrap=True)


class _ProgressLines:
    """Prints a line whenever the stage or the step changes: for a log."""

    def __init__(self, console: Console) -> None:
        self._console, self._printed = console, ("", "")
        self._events = _EventLines(console)

    def __call__(self, progress: RunProgress) -> None:
        self._events(progress)
        now = (progress.stage.words, _label(progress))
        if now != self._printed:
            self._printed = now
            self._console.print(
                f"{now[0]}: {now[1]} ({progress.time_s:.1f} s, {100.0 * progress.done:.0f} %)",
                highlight=False,
                soft_wrap=True,
            )


def _label(progress: RunProgress) -> str:
    """The step of the program; while an axis is learning, its stroke, the remaining time and the best J."""
    learning = progress.learning
    if not learning.planned or learning.state not in ACTIVE:
        return progress.label
    at = f" at {learning.acceleration_m_s2 * 1e3:.3g} mm/s^2"
    text = (
        f"axis {learning.axis}: {learning.stage}{'' if math.isnan(learning.acceleration_m_s2) else at}, "
        f"stroke {learning.strokes_done + 1} of {learning.strokes_total}, "
        f"{_minutes(learning.remaining_s)} left"
    )
    return text if math.isnan(learning.best_m) else f"{text}, best J {learning.best_m * 1e6:.2f} um"


def _minutes(time_s: float) -> str:
    return f"{time_s:.0f} s" if time_s < 120.0 else f"{time_s / 60.0:.0f} min"
