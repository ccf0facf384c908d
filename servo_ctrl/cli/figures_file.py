"""The figures of a study as a JSON file, where `--json` asks for one."""

import json
from pathlib import Path
from typing import Any

import typer

from servo_ctrl.files.whole_file import write_text_whole


def write_figures(path: Path | None, figures: dict[str, Any]) -> None:
    """Write the figures, where there is a path. Raises OSError."""
    if path is None:
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text_whole(path, json.dumps(figures, indent=2) + "\n")
    typer.echo(f"figures: {path}")
