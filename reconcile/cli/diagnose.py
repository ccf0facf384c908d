"""`reconcile diagnose`: recordings and a model in; verdict, repaired model and report out."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from reconcile.cli.options import MappingOption, NominalModelOption


class ProgressFormat(StrEnum):
    """`--progress`."""

    WORDS = "words"
    JSON = "json"


RecordingsArgument = Annotated[
    list[Path],
    typer.Argument(
        help="Directories of servo-ctrl; Parquet, CSV, JSON, npz, mat, MDF4 or candump files; folders of "
        "them, or a pattern such as 'runs/*.csv'."
    ),
]
OutOption = Annotated[Path, typer.Option(help="Directory for verdict.json, model.toml and report.html.")]
ReportOption = Annotated[bool, typer.Option("--report/--no-report", help="Write report.html.")]
ProofOption = Annotated[
    bool,
    typer.Option(
        "--proof/--no-proof", help="Leave each recording out in turn; hold the written model against it."
    ),
]
NextOption = Annotated[bool, typer.Option("--next/--no-next", help="Plan the next experiment.")]
NegligibleShareOption = Annotated[
    float,
    typer.Option(
        "--matters", min=0.0, max=0.5, help="Share of the motor force below which no effect is named."
    ),
]
ProgressOption = Annotated[
    ProgressFormat, typer.Option(help="On standard error: words, or for a program a line of JSON a step.")
]


def diagnose(
    recordings: RecordingsArgument,
    model: NominalModelOption,
    out: OutOption = Path("out/diagnosis"),
    mapping: MappingOption = None,
    report: ReportOption = True,
    proof: ProofOption = True,
    next_experiment: NextOption = True,
    negligible_share: NegligibleShareOption = 0.01,
    progress: ProgressOption = ProgressFormat.WORDS,
) -> None:
    """Find what the model has left out, how sure that is, and write the repaired model.

    The recordings may be of any motion; several together determine more than one. A folder stands for all
    files in it, and 'runs/**/circle*.csv' in quotes for what matches at any depth; a file that cannot be used
    among good ones is set aside and reported. What stands above the names of a CSV file is skipped, a row of
    units below them is understood. For a CSV file with the columns
    t (s), q (m, motor encoder at the table) and i (A), and a model that knows lead, torque constant and mass:

        reconcile diagnose run1.csv --map time=t,position=q,current=i --model axis.toml --out out/axis

    with axis.toml

        [axis.x]
        transmission.lead_mm = 5.0
        motor.torque_constant_nm_a = 0.4
        table.mass_kg = 50.0

    Open out/axis/report.html in a browser; `hil-sim run --machine out/axis/model.toml` runs the repaired
    model, and a second diagnosis with `--model out/axis/model.toml` shows what is still unexplained.

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
            with_next=next_experiment,
            negligible_force_share=negligible_share,
        )
    show(result.verdict, Console())
    typer.echo(f"\nverdict: {result.verdict_file}\nrepaired model: {result.model_file}")
    if result.report_file is not None:
        typer.echo(f"report: {result.report_file}")
