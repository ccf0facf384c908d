"""`reconcile trial`: axes with concealed physics, diagnosed blind, and the score."""

from pathlib import Path
from typing import Annotated, Any

import typer

from reconcile.trials.seeds import FIRST_SCORED_SEED

SeedOption = Annotated[
    int,
    typer.Option(
        min=0,
        help=f"First seed; fresh from {FIRST_SCORED_SEED} on. What was scored before is refused, and the "
        "first fresh one named. Below 10000: training.",
    ),
]
CasesOption = Annotated[int, typer.Option(min=1, help="How many seeds, one a case.")]
JsonOption = Annotated[
    Path, typer.Option("--json", help="Where the scores go, and every case with its truth.")
]
PageOption = Annotated[Path | None, typer.Option(help="Also write the scores as a page, with pictures.")]
GeneratorOption = Annotated[str, typer.Option(help="Module that draws and records the cases.")]
ProcessesOption = Annotated[int, typer.Option(min=1, help="Cases that are diagnosed side by side.")]
BesideOption = Annotated[
    str | None,
    typer.Option(help="Module of another tool, scored on the same cases: tests.campaigns.bench.sindy_trial"),
]
KeepOption = Annotated[Path | None, typer.Option(help="Keep recordings, truths and verdicts there.")]


def trial(
    seed: SeedOption = FIRST_SCORED_SEED,
    cases: CasesOption = 20,
    json_file: JsonOption = Path("out/trial.json"),
    page: PageOption = None,
    generator: GeneratorOption = "tests.campaigns.blind",
    processes: ProcessesOption = 2,
    beside: BesideOption = None,
    keep: KeepOption = None,
) -> None:
    """Diagnose concealed cases: the hash of each truth is printed before, the truth after."""
    import json

    from rich.console import Console

    from reconcile.trials.page import write_page
    from reconcile.trials.summary import summary
    from reconcile.trials.trial import Seal, claimed, name_of, trials
    from servo_ctrl.files.whole_file import write_text_whole

    console = Console(highlight=False, soft_wrap=True)
    rows: list[dict[str, Any]] = []
    other_tool = beside and name_of(beside)

    def print_seal(seal: Seal) -> None:
        console.print(f"{seal.seed}: truth sealed, SHA-256 {seal.sha256}")

    is_scored = claimed(generator, seed, cases)
    seeds = range(seed, seed + cases)
    for row in trials(seeds, generator, processes=processes, on_sealed=print_seal, keep=keep, beside=beside):
        rows.append(row)
        console.print(f"[{len(rows)}/{cases}] {case_line(row)}", markup=False)
    content: dict[str, Any] = {
        "generator": generator,
        "first_seed": seed,
        "cases": cases,
        "scored": is_scored,
        "summary": summary(rows),
        "beside": other_tool and {"name": other_tool, "summary": summary([row["beside"] for row in rows])},
        "rows": rows,
    }
    json_file.parent.mkdir(parents=True, exist_ok=True)
    write_text_whole(json_file, json.dumps(content, indent=1) + "\n")
    for name, entry in content["summary"]["scores"].items():
        if entry["value"] is not None:
            low, high = entry["ci95"]
            console.print(
                f"{name}: {entry['value']:.3f} [{low:.3f}, {high:.3f}] of {entry['of']}", markup=False
            )
    if page is not None:
        write_page(content, page)


def case_line(row: dict[str, Any]) -> str:
    """Return the truth of a case, its verdict and its score in one line."""
    planted = ", ".join(
        effect["name"] + ("" if effect["observable"] else f" (not observable: {effect['why_not']})")
        for effect in row["planted"]
    )
    findings = ", ".join(f"{f['effect']} {f['confidence']:.2f}" for f in row["findings"])
    return (
        f"{row['seed']}: {row['kind']}: {planted or 'nothing concealed'} | {row['verdict']}"
        f"{': ' + findings if findings else ''}{row['error'] and ' ' + row['error']} | "
        f"first {row['first'] or '-'}, false {len(row['false'])}, {row['seconds']:.1f} s"
    )
