"""The progress bar of a run, on standard error, where that is a terminal; else a line a step."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

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

        def show(progress: RunProgress) -> None:
            bar.update(
                task,
                completed=progress.done,
                description=progress.label,
                stage=_stage(progress),
                time_s=progress.time_s,
            )

        yield show


class _Lines:
    """Progress for a log: a line whenever the stage or the step changes."""

    def __init__(self, console: Console) -> None:
        self._console, self._said = console, ("", "")

    def __call__(self, progress: RunProgress) -> None:
        now = (_stage(progress), progress.label)
        if now != self._said:
            self._said = now
            self._console.print(
                f"{now[0]}: {now[1]} ({progress.time_s:.1f} s, {100.0 * progress.done:.0f} %)",
                highlight=False,
            )


def _stage(progress: RunProgress) -> str:
    return progress.stage.name.lower().replace("_", " ")
