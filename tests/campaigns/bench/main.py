"""`make bench`: every ratio, measured side by side, as a table and as JSON.

Run as `python -m tests.campaigns.bench.main --json bench.json [--only batch|lockstep|tick-lateness|memory]`.
"""

import json
import os
import platform
import time
from collections.abc import Callable
from datetime import UTC, datetime
from enum import StrEnum
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from tests.campaigns.bench import batch, lockstep, memory, tick_lateness
from tests.campaigns.bench.outcome import Ratio, Section

LIBRARIES = ("servo-ctrl", "numpy", "numba", "canopen", "python-can", "pyarrow")


class Benchmark(StrEnum):
    """What can be measured."""

    BATCH = "batch"
    LOCKSTEP = "lockstep"
    TICK_LATENESS = "tick-lateness"
    MEMORY = "memory"


MEASURE: dict[Benchmark, Callable[..., Section]] = {
    Benchmark.BATCH: batch.measure,
    Benchmark.LOCKSTEP: lockstep.measure,
    Benchmark.TICK_LATENESS: tick_lateness.measure,
    Benchmark.MEMORY: memory.measure,
}


def main(
    json_file: Annotated[Path, typer.Option("--json", help="Where the figures go.")],
    only: Annotated[list[Benchmark] | None, typer.Option(help="Measure this one only; repeatable.")] = None,
    rounds: Annotated[
        int, typer.Option(min=1, help="Of tick lateness: circles of 6 s under each policy.")
    ] = tick_lateness.ROUNDS,
) -> None:
    """Measure, print a table, write the JSON file whole."""
    console = Console()
    started, start_s = datetime.now(UTC), time.monotonic()
    load = os.getloadavg()[0]
    sections: list[Section] = []
    failures: dict[str, str] = {}
    with console.status("benchmarks") as status:

        def progress(text: str) -> None:
            status.update(text)
            if not console.is_terminal:
                console.print(text)

        for name in only or list(Benchmark):
            try:
                given = {"rounds": rounds} if name is Benchmark.TICK_LATENESS else {}
                sections.append(MEASURE[name](progress, **given))
            except Exception as error:  # noqa: BLE001  # the other figures are wanted all the same
                failures[name] = f"{type(error).__name__}: {error}"
    result = {
        "started": started.isoformat(timespec="seconds"),
        "duration_s": round(time.monotonic() - start_s, 1),
        "machine": {**machine_facts(), "load_before": load},
        "sections": [section.as_json() for section in sections],
        "failed": failures,
    }
    write_whole(json_file, json.dumps(result, indent=2) + "\n")
    console.print(table_of(sections))
    for section in sections:
        for skip in section.skips:
            console.print(f"[yellow]skipped[/] {skip.name}: {skip.reason}")
    for failed, reason in failures.items():
        console.print(f"[red]failed[/] {failed}: {reason}")
    console.print(f"{result['duration_s']} s; written to {json_file}")
    if failures:
        raise typer.Exit(1)


def machine_facts() -> dict[str, Any]:
    """What the figures depend on."""
    return {
        "cores": os.cpu_count(),
        "processor": _processor(),
        "system": f"{platform.system()} {platform.release()}",
        "python": platform.python_version(),
        "libraries": {name: version(name) for name in LIBRARIES},
    }


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.machine()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def table_of(sections: list[Section]) -> Table:
    """Every ratio with its two measurements and its aim."""
    table = Table("ratio", "ours", "reference", "value", "aim", "met")
    for section in sections:
        for ratio in section.ratios:
            table.add_row(*_row(ratio))
        table.add_section()
    return table


def _row(ratio: Ratio) -> tuple[str, ...]:
    met = {None: "", True: "[green]yes[/]", False: "[red]no[/]"}[ratio.met]
    ours = f"{ratio.ours:.4g} {ratio.unit}"
    reference = f"{ratio.reference:.4g} {ratio.reference_unit or ratio.unit}"
    value = f"{ratio.value:.0f}" if ratio.value >= 100.0 else f"{ratio.value:.3g}"
    return ratio.name, ours, reference, value, ratio.aim_text, met


def write_whole(file: Path, text: str) -> None:
    """Write `file` so that nobody ever sees half of it."""
    nascent = file.with_name(f".{file.name}.{os.getpid()}")
    nascent.write_text(text, encoding="utf-8")
    nascent.replace(file)


if __name__ == "__main__":
    typer.run(main)
