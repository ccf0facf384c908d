"""The decision table: machines side by side, as Markdown."""

from collections.abc import Mapping

from studies.compensations.twin_study import Row


def markdown(found: Mapping[str, Mapping[str, Row]]) -> str:
    """A table of all machines side by side: peak / RMS / end point, micrometres."""
    names = dict.fromkeys(variant for rows in found.values() for variant in rows)
    lines = [
        f"| what acts | {' | '.join(found)} |",
        f"|---|{'---|' * len(found)}",
    ]
    for variant in names:
        cells = [_cell(rows.get(variant)) for rows in found.values()]
        lines.append(f"| {variant} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _cell(row: Row | None) -> str:
    return "-" if row is None else " / ".join(f"{value:.1f}" for value in row)
