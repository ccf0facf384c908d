"""Declarations of the options that the subcommands share."""

from pathlib import Path
from typing import Annotated

import typer

from shipped_files import shipped

MachineOption = Annotated[
    Path, typer.Option(help="Machine directory with plant.toml, or the plant file itself.", callback=shipped)
]
