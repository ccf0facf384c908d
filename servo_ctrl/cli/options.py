"""Options that several subcommands share, and how their values are read."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from servo_ctrl.config.load import load_program

if TYPE_CHECKING:
    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.config.program_model import ProgramConfig

MachineOption = Annotated[
    Path, typer.Option(help="Machine directory with controller.toml, or the file itself.", show_default=False)
]
ProgramOption = Annotated[
    Path | None, typer.Option(help="Program file (TOML). Without it the axes are switched on and held.")
]
InputOption = Annotated[
    list[str] | None,
    typer.Option("--input", help="NAME=FILE for a program's step that names an input; may be repeated."),
]
OutOption = Annotated[Path, typer.Option(help="Folder for pictures and recordings; made if absent.")]
TableOption = Annotated[
    Path, typer.Option(help="Directory of the X-Y table with controller.toml, plant.toml and programs/.")
]


def read_program(path: Path | None, machine: MachineConfig, inputs: list[str] | None) -> ProgramConfig | None:
    """The program of the options. Raises ConfigError, and typer.BadParameter for an ill-formed --input."""
    files = {}
    for text in inputs or []:
        name, separator, file = text.partition("=")
        if not (name and separator and file):
            raise typer.BadParameter(f'"{text}" is not NAME=FILE', param_hint="--input")
        files[name] = Path(file)
    return load_program(path, machine, files) if path is not None else None
