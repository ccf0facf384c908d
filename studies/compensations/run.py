"""`servo-ctrl experiment compensations`: every compensation on every machine, as tables and as Markdown."""

from collections.abc import Mapping
from pathlib import Path

from rich.console import Console
from rich.status import Status

from servo_ctrl.cli.figures_file import write_figures
from servo_ctrl.files.whole_file import write_text_whole
from studies.compensations.twin_study import Row, measured
from studies.markdown_table import markdown_table, titled

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
    console.print(titled("Largest errors by the scale, um: sine, peak / RMS / end point", markdown(found)))
    write_text_whole(out / "table.md", markdown(found))
    figures = {
        name: {variant: row._asdict() for variant, row in rows.items()} for name, rows in found.items()
    }
    write_figures(json_file, {"machines": figures})


def markdown(found: Mapping[str, Mapping[str, Row]]) -> str:
    """Return the decision table, a column per machine: peak / RMS / end point, micrometres."""
    names = dict.fromkeys(name for rows in found.values() for name in rows)
    cells = (
        (name, *(" / ".join(f"{um:.1f}" for um in rows.get(name, ())) or "-" for rows in found.values()))
        for name in names
    )
    return markdown_table(("what acts", *found), cells)
