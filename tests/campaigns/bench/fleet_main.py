"""Axes a minute of `reconcile fleet` against workers, and what the scheduler and the disk cost an axis.

Run as `python -m tests.campaigns.bench.fleet_main --json FILE [--axes 20]`; docs/fleets.md projects from its
figures.
"""

import json
import os
import tempfile
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import typer
from rich.console import Console
from rich.table import Table

from reconcile.fleet.cluster import local_cluster
from reconcile.fleet.dataset import AxisData
from reconcile.fleet.fleet import FleetOptions, diagnose_fleet, plan_fleet, write_results
from reconcile.fleet.rows import row_of_failure
from reconcile.fleet.store import store_result
from tests.campaigns.bench.fleet_axes import nothing, write_fleet
from tests.campaigns.bench.main import machine_facts, write_whole

WORKERS = (1, 2)
LIMIT_S = 600.0
TASKS = 1000
ROWS = 500
PROJECTED = 100_000


class Rate(NamedTuple):
    """One run of the fleet on so many workers, when every worker has loaded what it needs."""

    workers: int
    axes: int
    start_s: float
    """Until the cluster stands."""
    seconds: float
    axes_a_minute: float
    processor_s_an_axis: float
    """Of the workers: what a busy computer does not lengthen much."""
    kept_bytes_an_axis: float


def rate(dataset: Path, models: Path, out: Path, workers: int) -> Rate:
    """Diagnose all axes; the first of each worker is not counted."""
    started_s = time.perf_counter()
    with local_cluster(workers, "auto") as cluster:
        start_s = time.perf_counter() - started_s
        planned = plan_fleet(str(dataset), models, out, FleetOptions())
        first = planned._replace(tasks=planned.tasks[:workers])
        list(diagnose_fleet(first, out, cluster, LIMIT_S))
        rest = planned._replace(tasks=planned.tasks[workers:])
        before_s = _processor_s(cluster)
        began_s = time.perf_counter()
        rows = list(diagnose_fleet(rest, out, cluster, LIMIT_S))
        seconds = time.perf_counter() - began_s
        used_s = _processor_s(cluster) - before_s
    if any(row["status"] != "diagnosed" for row in rows):
        raise RuntimeError(f"not diagnosed: {[row['error'] for row in rows if row['error']]}")
    write_results(planned, out)
    kept = sum(file.stat().st_size for file in (out / "axes").rglob("*") if file.is_file())
    count = len(rows)
    return Rate(
        workers, count, start_s, seconds, 60.0 * count / seconds, used_s / count, kept / (count + workers)
    )


def _processor_s(cluster: Any) -> float:
    return float(sum(cluster.run_on_every_worker(time.process_time).values()))


def scheduler_ms() -> float:
    """Milliseconds that a task costs which does nothing, on two workers."""
    with local_cluster(2, "auto") as cluster:
        list(cluster.run(nothing, range(50), LIMIT_S))
        began_s = time.perf_counter()
        list(cluster.run(nothing, range(TASKS), LIMIT_S))
        return 1e3 * (time.perf_counter() - began_s) / TASKS


def store_ms(directory: Path) -> float:
    """Milliseconds to keep an axis on this disk, each file synchronised."""
    files = {"verdict.json": b"v" * 9000, "model.toml": b"m" * 2000}
    began_s = time.perf_counter()
    for number in range(ROWS):
        data = AxisData(f"m{number}", "x", "file:///nowhere", ())
        store_result(directory, row_of_failure(data, "key", "diagnosed", "") | {"error": None}, files)
    return 1e3 * (time.perf_counter() - began_s) / ROWS


def main(
    json_file: Annotated[Path, typer.Option("--json", help="Where the figures go.")],
    axes: Annotated[int, typer.Option(min=4, help="Axes of the fleet that is measured on.")] = 20,
) -> None:
    """Measure, print, write."""
    console = Console()
    rates = []
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        dataset, models = write_fleet(root, axes)
        recorded = sum(file.stat().st_size for file in dataset.rglob("*.parquet")) / axes
        for workers in WORKERS:
            console.print(f"{axes} axes on {workers} workers")
            rates.append(rate(dataset, models, root / f"out-{workers}", workers))
        console.print("the scheduler and the disk")
        task_ms, kept_ms = scheduler_ms(), store_ms(root / "store")
    heads = ("workers", "axes", "start s", "seconds", "axes a minute", "processor s an axis")
    table = Table(*heads, title="reconcile fleet")
    for one in rates:
        figures = (one.start_s, one.seconds, one.axes_a_minute, one.processor_s_an_axis)
        table.add_row(str(one.workers), str(one.axes), *(f"{figure:.3g}" for figure in figures))
    console.print(table)
    hours = PROJECTED * rates[0].processor_s_an_axis / 3600.0
    console.print(f"{task_ms:.2f} ms a task, {kept_ms:.2f} ms to keep an axis; {hours:.0f} worker-hours")
    result = {
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "machine": machine_facts(),
        "load": os.getloadavg(),
        "rates": [one._asdict() for one in rates],
        "speed_up": rates[1].axes_a_minute / rates[0].axes_a_minute,
        "recorded_bytes_an_axis": recorded,
        "scheduler_ms_a_task": task_ms,
        "store_ms_an_axis": kept_ms,
        "projected_axes": PROJECTED,
        "projected_worker_hours": hours,
    }
    write_whole(json_file, json.dumps(result, indent=1) + "\n")
    console.print(f"written to {json_file}")


if __name__ == "__main__":
    typer.run(main)
