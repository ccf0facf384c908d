"""Progress of `reconcile fleet` on standard error: a bar on a terminal, else a line for each axis."""

from collections import Counter
from collections.abc import Iterable, Sequence

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, Task, TextColumn, TimeElapsedColumn

from reconcile.fleet.rows import Row

RATE_S = 3600.0
"""Time over which the rate is averaged: not over all, because workers join and leave; chosen."""


def show_rows(rows: Iterable[Row], total: int, console: Console) -> None:
    """Show `total` rows as they arrive: a line for each problem, and the pace of all."""
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[pace]}", markup=False),
        TimeElapsedColumn(),
    )
    shown = console.is_terminal
    with Progress(
        *columns, console=console, transient=True, disable=not shown, speed_estimate_period=RATE_S
    ) as bar:
        task = bar.add_task("starting", total=total, pace="")
        for ended, row in enumerate(rows, start=1):
            name = f"{row['machine']}/{row['axis']}"
            problems = [f"{row['status']}: {row['error']}"] if row["error"] else []
            problems += [f"without {bad['file']}: {bad['reason']}" for bad in row["bad_files"]]
            for problem in problems:
                bar.console.print(f"{name}: {problem}", highlight=False, markup=False, soft_wrap=True)
            outcome = f"{name}: {row['verdict'] or row['status']}"
            bar.update(task, advance=1, description=outcome)
            pace = _pace(bar.tasks[0])
            bar.update(task, pace=pace)
            if not shown:
                line = f"[{ended}/{total}] {outcome}; {pace}"
                console.print(line, highlight=False, markup=False, soft_wrap=True)


def _pace(task: Task) -> str:
    """Return `12.3 axes a minute, 1 h 05 min to go`; empty before two axes are done."""
    if task.speed is None or task.time_remaining is None:
        return ""
    return f"{60.0 * task.speed:.3g} axes a minute, {duration(task.time_remaining)} to go"


def duration(seconds: float) -> str:
    """Format a duration, rounded according to its size."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60:02d} min"


def results_text(rows: Sequence[Row]) -> str:
    """Count verdicts in one line, then machines by effect, the most frequent first."""
    verdicts = Counter(row["verdict"] or row["status"] for row in rows)
    pairs = sorted({(one["effect"], row["machine"]) for row in rows for one in row["effects"]})
    machines = Counter(effect for effect, _ in pairs)
    lines = [", ".join(f"{word} {count}" for word, count in verdicts.most_common())]
    lines += [
        f"  {effect}: {count} machine{'s' if count > 1 else ''}" for effect, count in machines.most_common()
    ]
    return "\n".join(lines)
