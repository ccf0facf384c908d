"""`make bench-real`: axes that others have measured, each recording left out in turn; the tool and rivals.

Run as `python -m tests.campaigns.bench.real_main --json bench-real.json [--set NAME]... [--quick] [--data
DIRECTORY]`. The error is the RMS of what a model leaves of the filtered force of the recording that is left
out, in the samples in motion: of the model file that `reconcile diagnose` writes of the others, loaded again,
and of models that are fitted to the others. `--quick` leaves out two recordings of each machine. With `--set`
the rows of the other machines that the file has already stay.
"""

import json
import math
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from reconcile.errors import ReconcileError
from reconcile.examples.example import data_directory
from reconcile.examples.real.judged import Judged, error_of, judged
from reconcile.examples.real.machine import Machine
from reconcile.examples.real.study import MACHINES
from reconcile.examples.real.textbook import Predict
from reconcile.nominal_model.model_file import load_model
from tests.campaigns.bench.main import machine_facts, write_whole
from tests.campaigns.bench.real_rivals import RIVALS
from tests.campaigns.bench.real_sindy import pysindy
from tests.campaigns.bench.real_tool import ToolAnswer, ask

MODELS = ("reconcile", *RIVALS, "pysindy")
QUICK_LEFT_OUT = 2
AT_MOST_OF_BOOSTING = 1.2
"""The bar of `reconcile` against boosting, where that is better."""
SHORTEST_TRAIN_S = 1.0
"""Less motion than this in all other recordings of an axis, and nothing is fitted."""


def of_machine(
    machine: Machine,
    directory: Path,
    left_out: Sequence[str],
    models: Sequence[str],
    tell: Callable[[str], None],
) -> list[dict[str, Any]]:
    """A row for each axis in each recording left out."""
    nominal, paths = machine.written(directory / machine.name)
    axes, rows = judged(paths, nominal), []
    for number, path in enumerate(paths):
        if path.stem not in left_out:
            continue
        others = [other for other in paths if other != path]
        answer = ToolAnswer("not asked", [], None, 0.0)
        if "reconcile" in models:
            answer = ask(others, nominal, directory / machine.name / f"without_{path.stem}")
            how = f"{answer.verdict} in {answer.seconds:.0f} s {answer.failure}"
            tell(f"{machine.name} without {path.stem}: {how}")
        for axis, files in axes.items():
            train = [one for k, file in enumerate(files) if k != number for one in file]
            if (
                not files[number]
                or sum(one.used.sum() * one.data.period_s for one in train) < SHORTEST_TRAIN_S
            ):
                continue
            errors, why = _errors(answer, train, files[number], nominal, models)
            row = {
                "machine": machine.name,
                "axis": axis,
                "left_out": path.stem,
                "samples": int(sum(one.used.sum() for one in files[number])),
                "measured_nm": _pooled(files[number], lambda one: one.error(0.0 * one.force_n)),
                "errors_nm": errors,
                "verdict": answer.verdict,
                "named": answer.names(axis),
                "failure": "; ".join(filter(None, (answer.failure, why))),
                "seconds": answer.seconds,
            }
            tell(
                f"  {axis}: "
                + ", ".join(f"{k} {v:.4g}" for k, v in row["errors_nm"].items())
                + f"; {row['named']}"
            )
            rows.append(row)
    return rows


def _errors(
    answer: ToolAnswer,
    train: Sequence[Judged],
    left_out: Sequence[Judged],
    nominal: Path,
    models: Sequence[str],
) -> tuple[dict[str, float], str]:
    """By model, N; and why the tool has none."""
    errors: dict[str, float] = {}
    why = ""
    written = answer.model
    if written is not None:
        try:
            errors["reconcile"] = _pooled(left_out, lambda one: error_of(written, one))
        except ReconcileError as refused:
            why = f"its own model.toml is refused: {refused}"
    fitted: dict[str, Predict] = {name: fit(train) for name, fit in RIVALS.items() if name in models}
    if "pysindy" in models:
        try:
            fitted["pysindy"] = pysindy(train, load_model(nominal).axes[left_out[0].recording.axis])
        except ValueError as error:  # its library is the catalogue's, and fails where that does
            why = f"{why}; PySINDy: {error}"
    for name, predict in fitted.items():
        try:
            errors[name] = _pooled(left_out, lambda one, predict=predict: one.error(predict(one)))  # type: ignore[misc]
        except ValueError as error:  # the left-out recording lacks an axis that all others have
            why = f"{why}; {name}: {error}"
    return errors, why


def _pooled(pieces: Sequence[Judged], error: Callable[[Judged], float]) -> float:
    weights = [int(one.used.sum()) for one in pieces]
    squares = [error(one) ** 2 if weight else 0.0 for one, weight in zip(pieces, weights, strict=True)]
    return math.sqrt(float(np.average(squares, weights=weights))) if any(weights) else 0.0


def summary(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """By machine and axis: the RMS over all that was left out, and whether the bars are met.

    Recordings of which the tool gave no model count for nobody, and are counted.
    """
    lines = []
    for machine, axis in dict.fromkeys((row["machine"], row["axis"]) for row in rows):
        own = [row for row in rows if (row["machine"], row["axis"]) == (machine, axis)]
        with_model = [row for row in own if "reconcile" in row["errors_nm"]] or own
        weights = [row["samples"] for row in with_model]
        errors = {
            name: math.sqrt(
                float(np.average([row["errors_nm"][name] ** 2 for row in with_model], weights=weights))
            )
            for name in MODELS
            if all(name in row["errors_nm"] for row in with_model)
        }
        failed = sum("reconcile" not in row["errors_nm"] for row in own)
        lines.append(
            {
                "machine": machine,
                "axis": axis,
                "left_out": len(own),
                "no_model": failed,
                "errors_nm": errors,
                "lost_to": ["no model"] if failed else lost_to(errors),
                "named": _counted(row["named"] for row in own),
            }
        )
    return lines


def lost_to(errors: Mapping[str, float]) -> list[str]:
    """The rivals that the tool is worse than, by the bars of the benchmark."""
    ours = errors.get("reconcile", math.inf)
    factor = {"boosting": AT_MOST_OF_BOOSTING}
    return [
        name for name, error in errors.items() if name != "reconcile" and ours > factor.get(name, 1.0) * error
    ]


def _counted(named: Any) -> dict[str, int]:
    counts: dict[str, int] = {}
    for names in named:
        for name in dict.fromkeys(one.split()[0] for one in names):
            counts[name] = counts.get(name, 0) + 1
    return counts


def table_of(lines: Sequence[Mapping[str, Any]]) -> Table:
    """All axes, and where the tool loses."""
    table = Table("axis", *(f"{name} / N m" for name in MODELS), "no model", "loses to", "named")
    for line in lines:
        errors = [f"{line['errors_nm'][name]:.4g}" if name in line["errors_nm"] else "-" for name in MODELS]
        named = ", ".join(f"{name} {count}" for name, count in line["named"].items())
        failed = f"{line['no_model']} of {line['left_out']}"
        lost = ", ".join(line["lost_to"]) or "nobody"
        table.add_row(f"{line['machine']} {line['axis']}", *errors, failed, lost, named)
    return table


def kept(json_file: Path, asked: Sequence[str]) -> list[dict[str, Any]]:
    """Rows of machines that are not asked for, of a file that is there already, in the order of the sets."""
    if not json_file.is_file():
        return []
    rows: list[dict[str, Any]] = json.loads(json_file.read_text(encoding="utf-8"))["rows"]
    return [row for row in rows if row["machine"] not in asked]


def in_order(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """The rows in the order of the sets."""
    order = list(MACHINES)
    return sorted(rows, key=lambda row: order.index(row["machine"]) if row["machine"] in order else -1)


def main(
    json_file: Annotated[Path, typer.Option("--json", help="Where the figures go.")],
    sets: Annotated[list[str] | None, typer.Option("--set", help="Only these; all without.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Leave out two recordings of each machine.")] = False,
    without: Annotated[list[str] | None, typer.Option(help="Models that are left away.")] = None,
    data: Annotated[Path | None, typer.Option(help="Where the published sets are.")] = None,
) -> None:
    """Compare, print, write."""
    console = Console()

    def tell(text: str) -> None:
        console.print(text, highlight=False, markup=False, soft_wrap=True)

    place, started_s = data_directory("axes", data), time.perf_counter()
    models = [name for name in MODELS if name not in (without or [])]
    result: dict[str, Any] = {
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "machine": {**machine_facts(), **{name: version(name) for name in ("pysindy", "scikit-learn")}},
        "quick": quick,
        "rows": kept(json_file, sets or list(MACHINES)),
    }
    with tempfile.TemporaryDirectory() as directory:
        for name in sets or MACHINES:
            machine = MACHINES[name](place)
            recordings = list(machine.recordings)[: QUICK_LEFT_OUT if quick else None]
            result["rows"] = in_order(
                [*result["rows"], *of_machine(machine, Path(directory), recordings, models, tell)]
            )
            result["summary"], result["seconds"] = summary(result["rows"]), time.perf_counter() - started_s
            write_whole(json_file, json.dumps(result, indent=1) + "\n")
    console.print(table_of(result["summary"]))
    tell(f"written to {json_file}")


if __name__ == "__main__":
    typer.run(main)
