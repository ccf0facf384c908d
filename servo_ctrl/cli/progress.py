"""The progress bar of a run, on standard error, where that is a terminal; else a line a step. And events."""

from __future__ import annotations

import contextlib
import math
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

from servo_ctrl.daemon.learning_states import GOING_ON

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from servo_ctrl.daemon.report import Progress as RunProgress


@contextlib.contextmanager
def progress_bar() -> Iterator[Callable[[RunProgress], None]]:
    """Yield what `run_machine` wants as `on_progress`."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield _Lines(console)
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
        events = _Events(console)

        def show(progress: RunProgress) -> None:
            events(progress)
            bar.update(
                task,
                completed=progress.done,
                description=_label(progress),
                stage=_stage(progress),
                time_s=progress.time_s,
            )

        yield show


class _Events:
    """What happens, a line each, as it happens."""

    def __init__(self, console: Console) -> None:
        self._console, self._told = console, 0

    def __call__(self, progress: RunProgress) -> None:
        new = progress.events_count - self._told
        self._told = progress.events_count
        if new > len(progress.events):
            self._say(f"{new - len(progress.events)} more events")
        for event in progress.events[max(len(progress.events) - new, 0) :]:
            self._say(event)

    def _say(self, text: str) -> None:
        self._console.print(f"servo-ctrl: {text}", highlight=False, markup=False, soft_wrap=True)


class _Lines:
    """Progress for a log: a line whenever the stage or the step changes."""

    def __init__(self, console: Console) -> None:
        self._console, self._said = console, ("", "")
        self._events = _Events(console)

    def __call__(self, progress: RunProgress) -> None:
        self._events(progress)
        now = (_stage(progress), _label(progress))
        if now != self._said:
            self._said = now
            self._console.print(
                f"{now[0]}: {now[1]} ({progress.time_s:.1f} s, {100.0 * progress.done:.0f} %)",
                highlight=False,
                soft_wrap=True,
            )


def _label(progress: RunProgress) -> str:
    """The step of the program; while an axis is learning, how far it is."""
    learning = progress.learning
    outlook = learning.outlook
    if outlook is None or learning.state not in GOING_ON:
        return progress.label
    at = f" at {outlook.acceleration_m_s2 * 1e3:.3g} mm/s^2"
    text = (
        f"axis {learning.axis}: {outlook.stage}{'' if math.isnan(outlook.acceleration_m_s2) else at}, "
        f"stroke {outlook.strokes_done + 1} of {outlook.strokes_total}, {_minutes(outlook.remaining_s)} left"
    )
    return text if math.isnan(outlook.best_m) else f"{text}, best J {outlook.best_m * 1e6:.2f} um"


def _minutes(time_s: float) -> str:
    return f"{time_s:.0f} s" if time_s < 120.0 else f"{time_s / 60.0:.0f} min"


def _stage(progress: RunProgress) -> str:
    return progress.stage.name.lower().replace("_", " ")
