"""`servo-ctrl experiment compensations`: every compensation on every machine, as tables and as Markdown."""

from collections.abc import Mapping
from pathlib import Path

from rich.console import Console
from rich.status import Status
from rich.table import Table

from servo_ctrl.cli.figures_file import write_figures
from servo_ctrl.files.whole_file import write_text_whole
from studies.compensations.twin_study import Row, measured

MACHINES = [Path("machines/xy_table"), Path("machines/fuzzy_table"), Path("machines/precision_stage")]


def run_compensations(machine: list[Path] | None, out: Path, json_file: Path | None) -> None:
    """Measure every compensation alone and together, on every machine: sines and end points, in the twin."""
    console = Console()
    out.mkdir(parents=True, exist_ok=True)
    found: dict[str, dict[str, Row]] = {}
    for directory in machine or MACHINES:
        with console.status(f"{directory.name}: starting") as status:

            def show(line: str, status: Status = status, name: str = directory.name) -> None:
                status.update(f"{name}: {line}")

            found[directory.name] = measured(directory, show)
        console.print(_table(directory.name, found[directory.name]))
    write_text_whole(out / "table.md", markdown(found))
    figures = {
        name: {variant: row._asdict() for variant, row in rows.items()} for name, rows in found.items()
    }
    write_figures(json_file, {"machines": figures})


def markdown(found: Mapping[str, Mapping[str, Row]]) -> str:
    """Return the decision table, a column per machine: peak / RMS / end point, micrometres."""
    lines = [f"| what acts | {' | '.join(found)} |", f"|---|{'---|' * len(found)}"]
    for name in dict.fromkeys(name for rows in found.values() for name in rows):
        cells = [" / ".join(f"{value:.1f}" for value in rows.get(name, ())) or "-" for rows in found.values()]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _table(name: str, rows: dict[str, Row]) -> Table:
    table = Table(title=f"{name}: largest errors by the scale, um")
    for heading in ("what acts", "sine, peak", "sine, RMS", "end point"):
        table.add_column(heading, justify="left" if heading == "what acts" else "right")
    for variant, row in rows.items():
        table.add_row(variant, *(f"{value:.2f}" for value in row))
    return table
