"""`make bench-reconcile`: `reconcile diagnose` and PySINDy on the same concealed cases, and the time taken.

Run as `python -m tests.campaigns.bench.reconcile_main --json bench-reconcile.json [--cases 30] [--first-seed
100400]`. Both start from the same files and the same check of the sensors; truth is looked at when both have
answered.
"""

import json
import tempfile
import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from reconcile.diagnosis.diagnose import diagnose
from tests.campaigns.bench import reconcile_time, sindy_peer, sindy_trial
from tests.campaigns.bench.main import machine_facts, write_whole
from tests.campaigns.bench.reconcile_score import ToolAnswer, judge, summary
from tests.campaigns.blind import draw, record
from tests.campaigns.blind.case import Case
from tests.campaigns.blind.recorded import SEALED

SCORED_FROM = 100_400
"""Seeds below 10 000, and 100 000 to 100 399, are for training: thresholds of both sides come from them."""


def by_reconcile(paths: Sequence[Path], directory: Path) -> ToolAnswer:
    """What `reconcile diagnose` says."""
    started_s = time.perf_counter()
    verdict = diagnose(paths, directory / "model.toml", directory / "out").verdict
    seconds = time.perf_counter() - started_s
    fits = {
        f"{axis} {channel}": channels[channel]
        for axis, channels in verdict["fit"].items()
        for channel in ("force", "deviation")
        if channel in channels
    }
    return ToolAnswer(
        verdict["verdict"],
        verdict["findings"],
        {key: fit["after"]["heldout"] / fit["refitted"]["heldout"] for key, fit in fits.items()},
        {key: fit["after"]["heldout"] for key, fit in fits.items()},
        seconds,
    )


def by_sindy(paths: Sequence[Path], directory: Path) -> ToolAnswer:
    """What PySINDy says; of equivalents it knows the catalogue's."""
    started_s = time.perf_counter()
    answer = sindy_trial.answer(paths, directory / "model.toml")
    seconds = time.perf_counter() - started_s
    left, level = (
        {
            f"{axis} {channel}": value
            for axis, channels in answer[key].items()
            for channel, value in channels.items()
        }
        for key in ("left", "level")
    )
    return ToolAnswer(answer["verdict"], answer["findings"], left, level, seconds)


TOOLS: dict[str, Callable[[Sequence[Path], Path], ToolAnswer]] = {
    "reconcile": by_reconcile,
    "pysindy": by_sindy,
}


def answers_to(case: Case) -> tuple[dict[str, Any], dict[str, ToolAnswer]]:
    """The truth, and the answers of both to a case. Of one that fails the reason is kept."""
    answers = {}
    with tempfile.TemporaryDirectory() as name:
        directory = Path(name)
        paths = record(case, directory)
        for tool, ask in TOOLS.items():
            try:
                answers[tool] = ask(paths, directory)
            except Exception as error:  # noqa: BLE001  # the other cases are wanted all the same
                answers[tool] = ToolAnswer("failed", [], {}, {}, 0.0, f"{type(error).__name__}: {error}")
        truth = json.loads((directory / SEALED / "truth.json").read_text(encoding="utf-8"))
    return truth, answers


def compare(seeds: Sequence[int], progress: Callable[[str], None]) -> dict[str, Any]:
    """All cases, then the lines of both."""
    judged: dict[str, list[tuple[dict[str, Any], ToolAnswer]]] = {tool: [] for tool in TOOLS}
    rows = []
    for seed in seeds:
        truth, answers = answers_to(draw(seed))
        row: dict[str, Any] = {"seed": seed, "kind": truth["kind"]}
        for tool, answer in answers.items():
            marks = judge(truth, answer)
            judged[tool].append((marks, answer))
            row["planted"] = marks["planted"]
            row[tool] = {
                **{key: marks[key] for key in ("first", "found", "false")},
                "named": [[one["effect"], *one["equivalent"]] for one in answer.findings],
                **{key: value for key, value in answer._asdict().items() if key != "findings"},
            }
        rows.append(row)
        hidden = ", ".join(
            effect["name"] + (f" ({effect['why_not']})" if effect["why_not"] else "")
            for effect in row["planted"]
        )
        answers_text = "; ".join(f"{tool}: {_answer(answer)}" for tool, answer in answers.items())
        progress(f"{seed} {truth['kind']} [{hidden}]: {answers_text}")
    return {"summary": {tool: summary(own) for tool, own in judged.items()}, "cases": rows}


def _answer(answer: ToolAnswer) -> str:
    names = ", ".join(one["effect"] for one in answer.findings)
    return f"{names or answer.failure or answer.verdict} ({answer.seconds:.0f} s)"


def table_of(lines: dict[str, dict[str, Any]]) -> Table:
    """Both, side by side."""
    table = Table("", *lines, title="the same concealed cases")
    for name in next(iter(lines.values())):
        table.add_row(name, *(_cell(own[name]) for own in lines.values()))
    return table


def _cell(line: dict[str, Any]) -> str:
    if "of" not in line:
        return f"{line['value']:.3g}"
    low, high = line["ci95"]
    share = f"{100.0 * line['count'] / line['of']:.0f} %" if line["of"] else "-"
    return f"{line['count']} of {line['of']} = {share} [{100 * low:.0f}, {100 * high:.0f}]"


def main(
    json_file: Annotated[Path, typer.Option("--json", help="Where the figures go.")],
    cases: Annotated[int, typer.Option(help="How many concealed cases.")] = 30,
    first_seed: Annotated[int, typer.Option(help="Fresh seeds start here.")] = SCORED_FROM,
    time_too: Annotated[bool, typer.Option("--time/--no-time", help="Measure the time too.")] = True,
) -> None:
    """Compare, measure, print, write."""
    console = Console()

    def progress(text: str) -> None:
        console.print(text, highlight=False, markup=False, soft_wrap=True)

    result: dict[str, Any] = {
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "machine": {**machine_facts(), "pysindy": version("pysindy")},
        "seeds": [first_seed, first_seed + cases],
        "rules_of_the_peer": sindy_peer.RULES._asdict(),
    }
    result |= compare(range(first_seed, first_seed + cases), progress)
    console.print(table_of(result["summary"]))
    write_whole(json_file, json.dumps(result, indent=1) + "\n")
    if time_too:
        costs = reconcile_time.measure(progress)
        result["time"] = reconcile_time.as_json(costs)
        console.print(reconcile_time.table_of(costs))
        write_whole(json_file, json.dumps(result, indent=1) + "\n")
    console.print(f"written to {json_file}")


if __name__ == "__main__":
    typer.run(main)
