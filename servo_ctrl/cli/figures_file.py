"""The JSON file of a study's figures (`--json`)."""

import json
from pathlib import Path
from typing import Any

import typer

from servo_ctrl.files.whole_file import write_text_whole


def write_figures(path: Path | None, figures: dict[str, Any]) -> None:
    """Write the figures if a path is given. Raises OSError."""
    if path is None:
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text_whole(path, json.dumps(figures, indent=2) + "\n")
    typer.echo(f"figures: {path}")
