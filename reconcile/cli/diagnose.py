"""`reconcile diagnose`: recordings and a model in; verdict, repaired model and report out."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer


class ProgressFormat(StrEnum):
    """`--progress`."""

    WORDS = "words"
    JSON = "json"


def diagnose(
    recordings: Annotated[
        list[Path],
        typer.Argument(
            help="Directories of servo-ctrl; Parquet, CSV, JSON, npz, mat, MDF4 or candump files; folders of "
            "them, or a pattern such as 'runs/*.csv'."
        ),
    ],
    model: Annotated[Path, typer.Option(help="Nominal model: a plant.toml, or as much of one as is known.")],
    out: Annotated[Path, typer.Option(help="Directory for verdict.json, model.toml and report.html.")] = Path(
        "out/diagnosis"
    ),
    mapping: Annotated[
        list[str] | None,
        typer.Option("--map", help="Which column is what: time=t_s,position=q_m,force=F_N; may be repeated."),
    ] = None,
    report: Annotated[bool, typer.Option("--report/--no-report", help="Write report.html.")] = True,
    proof: Annotated[
        bool,
        typer.Option(
            "--proof/--no-proof", help="Leave each recording out in turn; hold the written model against it."
        ),
    ] = True,
    following: Annotated[bool, typer.Option("--next/--no-next", help="Plan the next experiment.")] = True,
    matters: Annotated[
        float,
        typer.Option(min=0.0, max=0.5, help="Share of the motor force below which no effect is named."),
    ] = 0.01,
    progress: Annotated[
        ProgressFormat,
        typer.Option(help="On standard error: words, or for a program a line of JSON a step."),
    ] = ProgressFormat.WORDS,
) -> None:
    """Say what the model has left out, how sure that is, and write the repaired model.

    The recordings may be of any motion; several together tell more than one. A folder stands for all that it
    holds, and 'runs/**/circle*.csv' in quotes for what matches at any depth; a file that cannot be used among
    good ones is set aside, and said. What stands above the names of a CSV file is skipped, a row of units
    below them is understood. For a CSV file with the columns
    t (s), q (m, motor encoder at the table) and i (A), and a model that knows lead, torque constant and mass:

        reconcile diagnose run1.csv --map time=t,position=q,current=i --model axis.toml --out out/axis

    with axis.toml

        [axis.x]
        transmission.lead_mm = 5.0
        motor.torque_constant_nm_a = 0.4
        table.mass_kg = 50.0

    Open out/axis/report.html in a browser; `hil-sim run --machine out/axis/model.toml` runs the repaired
    model, and a second diagnosis with `--model out/axis/model.toml` shows what is left.

    Exit codes: 0 the verdict is written, whatever it says; 1 a file cannot be used, and standard error says
    which, where and why; 2 wrong use of the command; 130 interrupted by Ctrl-C, with no file half written.
    """
    from rich.console import Console

    from kernels.heap import give_large_arrays_back
    from reconcile.cli.diagnose_progress import show_progress, steps_of
    from reconcile.diagnosis.diagnose import diagnose as run_diagnosis
    from reconcile.formats.mapping import parse_mapping
    from reconcile.nominal_model.model_file import load_model
    from reconcile.report.console import show

    give_large_arrays_back()
    steps = steps_of(list(load_model(model).axes))
    with show_progress(steps, as_json=progress is ProgressFormat.JSON) as on_progress:
        result = run_diagnosis(
            recordings,
            model,
            out,
            parse_mapping(mapping or []),
            on_progress,
            with_report=report,
            with_proof=proof,
            with_next=following,
            matters=matters,
        )
    show(result.verdict, Console())
    typer.echo(f"\nverdict: {result.verdict_file}\nrepaired model: {result.model_file}")
    if result.report_file is not None:
        typer.echo(f"report: {result.report_file}")
