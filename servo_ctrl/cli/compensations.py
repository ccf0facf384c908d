"""`servo-ctrl experiment compensations`: what each compensation is worth on each machine."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table

from servo_ctrl.cli.figures_file import JsonOption, write_figures
from servo_ctrl.cli.options import OutOption  # noqa: TC001  # typer reads it at run time
from servo_ctrl.experiment.compensations import Row, markdown, measured
from servo_ctrl.telemetry.parquet import write_whole

if TYPE_CHECKING:
    from rich.status import Status

MACHINES = [Path("machines/xy_table"), Path("machines/fuzzy_table"), Path("machines/precision_stage")]


def compensations(
    machine: Annotated[
        list[Path] | None, typer.Option(help="Directory of a machine; may be repeated. Default: all three.")
    ] = None,
    out: OutOption = Path("out/compensations"),
    json_file: JsonOption = None,
) -> None:
    """Measure every compensation alone and together, on every machine: sines and end points, in the twin.

    All loops are closed by the controller (CST), so that every compensation can act. What is learned is
    learned first, on other motions. Writes OUT/table.md, the table of docs/compensations.md.
    """
    console = Console()
    found: dict[str, dict[str, Row]] = {}
    for directory in machine or MACHINES:
        with console.status(f"{directory.name}: starting") as status:

            def show(line: str, status: Status = status, name: str = directory.name) -> None:
                status.update(f"{name}: {line}")

            found[directory.name] = measured(directory, out, show)
        console.print(_table(directory.name, found[directory.name]))
    text = markdown(found)
    write_whole(out / "table.md", lambda temporary: temporary.write_text(text, encoding="utf-8"))
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
