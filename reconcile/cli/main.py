"""`reconcile`: which physics did the simulation leave out?"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from reconcile.diagnose import diagnose as run_diagnosis
from reconcile.errors import ReconcileError
from reconcile.formats.mapping import parse_mapping
from reconcile.recording import ReadOptions
from reconcile.verdict import sentences

app = typer.Typer(no_args_is_help=True, add_completion=False)


@app.callback()
def reconcile() -> None:
    """Find the physics that a simulation left out, from recordings that disagree with it."""


@app.command()
def diagnose(
    recordings: Annotated[
        list[Path],
        typer.Argument(help="Directories of servo-ctrl; Parquet, CSV, npz, mat, MDF4, candump files."),
    ],
    model: Annotated[Path, typer.Option(help="Nominal model: a plant.toml, or as much of one as is known.")],
    out: Annotated[Path, typer.Option(help="Where verdict.json and model.toml go.")] = Path("out/diagnosis"),
    mapping: Annotated[
        list[str] | None,
        typer.Option("--map", help="Which column is what: time=t_s,position=q_m,force=F_N; may be repeated."),
    ] = None,
) -> None:
    """Say what the model has left out, how sure that is, and write the repaired model."""
    console = Console()
    options = ReadOptions(parse_mapping(mapping or []))
    with Console(stderr=True).status("reading") as status:
        found = run_diagnosis(recordings, model, out, options, status.update)
    for line in sentences(found.verdict):
        console.print(line, highlight=False, soft_wrap=True)
    console.print(f"verdict: {found.verdict_file}, repaired model: {found.model_file}", highlight=False)


def main() -> None:
    """Entry point: errors of ours are one line."""
    try:
        app()
    except ReconcileError as error:
        sys.exit(f"reconcile: {error}")
