"""`servo-ctrl experiment compensations`: what each compensation is worth on each machine."""

from pathlib import Path

from rich.console import Console
from rich.status import Status
from rich.table import Table

from servo_ctrl.cli.figures_file import write_figures
from servo_ctrl.files.whole_file import write_text_whole
from studies.compensations.decision_table import markdown
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
    text = markdown(found)
    write_text_whole(out / "table.md", text)
    figures = {
        name: {variant: row._asdict() for variant, row in rows.items()} for name, rows in found.items()
    }
    write_figures(json_file, {"machines": figures})


def _table(name: str, rows: dict[str, Row]) -> Table:
    table = Table(title=f"{name}: largest errors by the scale, um")
    for heading in ("what acts", "sine, peak", "sine, RMS", "end point"):
        table.add_column(heading, justify="left" if heading == "what acts" else "right")
    for variant, row in rows.items():
        table.add_row(variant, *(f"{value:.2f}" for value in row))
    return table
