"""One version of what was learned, for a reader."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rich.table import Table

from servo_ctrl.learning.screw import ScrewLearned

if TYPE_CHECKING:
    from servo_ctrl.config.learned_file import LearnedFile
    from servo_ctrl.learning.types import Learned
    from servo_ctrl.telemetry.learned_store import VersionEntry


def description(entry: VersionEntry, result: LearnedFile[Any]) -> list[str]:
    """Where a version comes from, what it depends on, and what it holds, in lines."""
    functions = result.learned
    return [
        f"axis {result.axis} of {result.machine}, version {result.version}"
        + (", in use" if entry.in_use else ""),
        *([f"cannot be used: {entry.problem}"] if entry.problem else []),
        f"learned at {result.learned_at} by servo-ctrl {result.software}, learner {functions.learner}",
        f"{functions.strokes} strokes, {functions.machine_time_s / 60.0:.1f} min of machine time",
        f"J {functions.before_m * 1e6:.2f} um before, {functions.after_m * 1e6:.2f} um after",
        "depends on:",
        *(f"  {key} = {value}" for key, value in result.basis.items()),
        "conditions:",
        *(f"  {key} = {value}" for key, value in result.conditions.items()),
        _particulars(functions.learned()),
    ]


def _particulars(learned: Learned | ScrewLearned) -> str:
    if isinstance(learned, ScrewLearned):
        least_m, most_m = min(row[2] for row in learned.points), max(row[2] for row in learned.points)
        over = f"{least_m * 1e6:.2f} to {most_m * 1e6:.2f} um over the travel"
        spread = f"spread {learned.spread_m * 1e6:.3f} um from travel to travel"
        return f"lost motion {learned.lost_motion_m * 1e6:.2f} um, {over}; {spread}"
    between = f"GRNN with spread {learned.spread_m_s2 * 1e3:.4g} mm/s^2" if learned.spread_m_s2 else "lines"
    return f"amplitude between the points: {between}"


def _nodes(learned: ScrewLearned) -> Table:
    table = Table(title="screw", title_justify="left")
    for heading in ("position mm", "error um", "lost motion um"):
        table.add_column(heading, justify="right")
    for position_m, error_m, lost_m in learned.points:
        table.add_row(f"{position_m * 1e3:.4f}", f"{error_m * 1e6:.3f}", f"{lost_m * 1e6:.3f}")
    return table


def tables_of(learned: Learned | ScrewLearned) -> list[Table]:
    """What was learned, point by point."""
    return [_nodes(learned)] if isinstance(learned, ScrewLearned) else _functions(learned)


def _functions(learned: Learned) -> list[Table]:
    tables = []
    for title, headings, points in (
        ("duration", ("T* ms",), learned.durations),
        ("amplitude", ("A* mm/s",), learned.amplitudes),
        ("second trapezoid", ("start ms", "duration ms", "amplitude mm/s"), learned.trailing),
    ):
        table = Table(title=title, title_justify="left")
        for heading in ("a mm/s^2", *headings):
            table.add_column(heading, justify="right")
        for point in points:
            table.add_row(*(f"{value * 1e3:.4g}" for value in point))
        tables += [table] if points else []
    return tables
