"""Progress of `reconcile fleet` on standard error: a bar on a terminal, else a line for each axis."""

import contextlib
from collections.abc import Iterable, Iterator

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from reconcile.fleet.progress import Pace
from reconcile.fleet.rows import Row


def show_rows(rows: Iterable[Row], total: int, console: Console) -> None:
    """Show `total` rows as they come: what could not be used, a line each, and the pace of all."""
    pace = Pace(total)
    with _progress(console, total) as bar:
        task = next(iter(bar.task_ids))
        for row in rows:
            pace.done()
            name = f"{row['machine']}/{row['axis']}"
            problems = [f"{row['status']}: {row['error']}"] if row["error"] else []
            problems += [f"without {bad['file']}: {bad['reason']}" for bad in row["bad_files"]]
            for problem in problems:
                bar.console.print(f"{name}: {problem}", highlight=False, markup=False, soft_wrap=True)
            outcome = f"{name}: {row['verdict'] or row['status']}"
            bar.update(task, advance=1, description=outcome, pace=pace.words())
            if not console.is_terminal:
                line = f"[{pace.ended}/{pace.total}] {outcome}; {pace.words()}"
                console.print(line, highlight=False, markup=False, soft_wrap=True)


@contextlib.contextmanager
def _progress(console: Console, total: int) -> Iterator[Progress]:
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[pace]}", markup=False),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        bar.add_task("starting", total=total, pace="")
        yield bar
