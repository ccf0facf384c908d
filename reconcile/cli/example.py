"""`reconcile example`: measured data that others have published, their figures beside ours."""

from collections.abc import Callable
from enum import Enum
from functools import partial
from pathlib import Path
from typing import Annotated

import typer


class DataSet(Enum):
    """The published data sets, by their names on the command line."""

    EMPS = "emps"
    ODRIVE = "odrive"
    FDITOOLS = "fditools"
    KUKA = "kuka"
    DFKI = "dfki"
    KINOVA = "kinova"
    BAM = "bam"


def example(
    name: Annotated[
        DataSet,
        typer.Argument(
            help="emps: a ball-screw axis; odrive: cogging of a motor; fditools: two masses on a flexible "
            "coupling; kuka: an industrial robot; dfki: a double pendulum; kinova: a cobot; bam: a servo."
        ),
    ],
    out: Annotated[Path, typer.Option(help="Where verdicts, models, reports and example.json go.")],
    data: Annotated[
        Path | None, typer.Option(help="Where the publisher's files are, if not in data/ or ../shared/data/.")
    ] = None,
) -> None:
    """Diagnose a published data set, and hold the figures against those of its publishers.

    The data are not part of this project: where they are absent, the message says who publishes them.

    Exit codes: 0 shown; 1 the data are not there or cannot be used.
    """
    from rich.console import Console
    from rich.table import Table

    from reconcile.examples import emps, odrive
    from reconcile.examples.example import ExampleResult, data_directory
    from reconcile.examples.real import study
    from reconcile.examples.real.study import SETS

    examples: dict[DataSet, tuple[str, Callable[[Path, Path, Callable[[str], None]], ExampleResult]]] = {
        DataSet.EMPS: (emps.NAME, emps.run),
        DataSet.ODRIVE: (odrive.NAME, odrive.run),
        **{
            DataSet(set_name): (study.NAME, partial(study.run, machines))
            for set_name, machines in SETS.items()
        },
    }
    folder, run = examples[name]
    progress = Console(stderr=True)
    result = run(
        data_directory(folder, data), out, lambda text: progress.print(text, style="dim", highlight=False)
    )
    table = Table(title=result.title, title_justify="left", box=None, pad_edge=False)
    for heading in ("figure", "ours", "published, or the mark"):
        table.add_column(heading, overflow="fold")
    for row in result.rows:
        table.add_row(*row)
    Console().print(table, highlight=False)
    for file in result.files:
        typer.echo(str(file))
