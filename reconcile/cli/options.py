"""Options that several subcommands share."""

from pathlib import Path
from typing import Annotated

import typer

NominalModelOption = Annotated[
    Path, typer.Option("--model", help="Nominal model: a plant.toml, or as much of one as is known.")
]
MappingOption = Annotated[
    list[str] | None,
    typer.Option("--map", help="Which column is what: time=t_s,position=q_m,force=F_N; may be repeated."),
]
