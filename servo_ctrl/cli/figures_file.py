"""The figures of an experiment as a JSON file, where one was asked for."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from servo_ctrl.telemetry.parquet import write_whole

JsonOption = Annotated[Path | None, typer.Option("--json", help="Write the figures to this file.")]


def write_figures(path: Path | None, figures: dict[str, Any]) -> None:
    """Write them whole. Raises OSError."""
    if path is None:
        return
    text = json.dumps(figures, indent=2) + "\n"
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))
    typer.echo(f"figures: {path}")
