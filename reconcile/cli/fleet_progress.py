"""Progress of `reconcile fleet` on standard error: a bar on a terminal, else a line for each axis."""

import time
from collections import Counter, deque
from collections.abc import Iterable, Sequence

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from reconcile.fleet.rows import Row

RATE_AXES = 200
"""Axes over which the rate is averaged: not over all, because workers join and leave; chosen."""


class Pace:
    """Measures how many axes are done in a minute."""

    def __init__(self, total: int) -> None:
        self.total, self.ended = total, 0
        self._times = deque([time.monotonic()], maxlen=RATE_AXES + 1)

    def count_axis(self) -> None:
        """Count one more axis, done now."""
        self.ended += 1
        self._times.append(time.monotonic())

    def text(self) -> str:
        """Return `12.3 axes a minute, 1 h 05 min to go`; empty before the first axis is done."""
        took_s = self._times[-1] - self._times[0]
        if len(self._times) < 2 or took_s <= 0.0:
            return ""
        rate_1_s = (len(self._times) - 1) / took_s
        return f"{60.0 * rate_1_s:.3g} axes a minute, {duration((self.total - self.ended) / rate_1_s)} to go"


def show_rows(rows: Iterable[Row], total: int, console: Console) -> None:
    """Show `total` rows as they arrive: a line for each problem, and the pace of all."""
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[pace]}", markup=False),
        TimeElapsedColumn(),
    )
    pace = Pace(total)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("starting", total=total, pace="")
        for row in rows:
            pace.count_axis()
            name = f"{row['machine']}/{row['axis']}"
            problems = [f"{row['status']}: {row['error']}"] if row["error"] else []
            problems += [f"without {bad['file']}: {bad['reason']}" for bad in row["bad_files"]]
            for problem in problems:
                bar.console.print(f"{name}: {problem}", highlight=False, markup=False, soft_wrap=True)
            outcome = f"{name}: {row['verdict'] or row['status']}"
            bar.update(task, advance=1, description=outcome, pace=pace.text())
            if not console.is_terminal:
                line = f"[{pace.ended}/{pace.total}] {outcome}; {pace.text()}"
                console.print(line, highlight=False, markup=False, soft_wrap=True)


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
