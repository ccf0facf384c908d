"""`reconcile fleet`: many axes of many machines, on the processors of this computer or of a cluster."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path  # typer reads the annotation at run time
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from reconcile.fleet import FleetOptions, check_workers, diagnose_fleet, finish, plan
from reconcile.fleet_cluster import cluster_at, local_cluster
from reconcile.fleet_progress import Pace, told
from reconcile.formats.mapping import parse_mapping

if TYPE_CHECKING:
    from collections.abc import Iterator

    from reconcile.fleet import Plan
    from reconcile.fleet_cluster import Cluster


def fleet(
    dataset: Annotated[str, typer.Argument(help="Directory, or URL that fsspec reads, of the recordings.")],
    model_dir: Annotated[Path, typer.Option(help="MACHINE/AXIS.toml, MACHINE.toml, or default.toml.")],
    out: Annotated[Path, typer.Option(help="Directory for the results; a second run goes on in it.")] = Path(
        "out/fleet"
    ),
    scheduler: Annotated[
        str | None, typer.Option(help="Address of a Dask scheduler: tcp://HOST:8786. Else a local cluster.")
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Processes of the local cluster; one a processor unless said.")
    ] = None,
    memory: Annotated[
        str, typer.Option(help="Most of a local worker, such as 2GiB; auto: its share.")
    ] = "auto",
    limit_s: Annotated[float, typer.Option(min=1.0, help="Longest time for one axis, in seconds.")] = 600.0,
    mapping: Annotated[
        list[str] | None,
        typer.Option("--map", help="Which column is what, as for diagnose; may be repeated."),
    ] = None,
    reports: Annotated[
        bool, typer.Option("--reports/--no-reports", help="Keep report.html of every axis, 6 MB each.")
    ] = False,
) -> None:
    """Diagnose every axis of many machines, and say which machines share which missing physics.

    The recordings lie as partitioned Parquet, one directory an axis, any number of files in each:

        fleet/machine=mill-1/axis=x/monday.parquet

        reconcile fleet fleet --model-dir models --out out/fleet

    A file that cannot be used is reported and left out; so is an axis without a model, one that takes too
    long, and one whose workers die. Every axis is written when it is done: after Ctrl-C, a crash or with new
    recordings the same command does only what is missing or has changed.

    OUT/results.parquet has a row for each axis, OUT/fleet.html shows them, OUT/axes/MACHINE/AXIS has the
    verdict and the repaired model of each.

    Exit codes: 0 the table is written, whatever became of single axes; 1 dataset, models, cluster or OUT
    cannot be used; 2 wrong use of the command; 130 interrupted by Ctrl-C, what was done is kept.
    """
    console = Console(stderr=True)
    options = FleetOptions(parse_mapping(mapping or []), reports, limit_s)
    with console.status("listing the dataset"):
        planned = plan(dataset, model_dir, out, options)
    total = len(planned.rows) + len(planned.tasks)
    console.print(
        f"{total} axes: {planned.kept} done before, {len(planned.tasks)} to do", highlight=False, markup=False
    )
    if planned.tasks:
        here = min(workers or os.cpu_count() or 1, len(planned.tasks))
        with cluster_at(scheduler) if scheduler else local_cluster(here, memory) as cluster:
            check_workers(cluster)
            _follow(planned, out, cluster, limit_s, console)
    table, page = finish(planned, out)
    typer.echo(told([planned.rows[name] for name in sorted(planned.rows)]))
    typer.echo(f"results: {table}\npage: {page}")


def _follow(planned: Plan, out: Path, cluster: Cluster, limit_s: float, console: Console) -> None:
    """A line for each axis that was not diagnosed, and the pace of all."""
    pace = Pace(len(planned.tasks))
    with _progress(console, len(planned.tasks)) as bar:
        task = next(iter(bar.task_ids))
        for row in diagnose_fleet(planned, out, cluster, limit_s):
            pace.done()
            name = f"{row['machine']}/{row['axis']}"
            if row["error"]:
                bar.console.print(
                    f"{name}: {row['status']}: {row['error']}", highlight=False, markup=False, soft_wrap=True
                )
            for bad in row["bad_files"]:
                bar.console.print(
                    f"{name}: without {bad['file']}: {bad['reason']}",
                    highlight=False,
                    markup=False,
                    soft_wrap=True,
                )
            bar.update(
                task, advance=1, description=f"{name}: {row['verdict'] or row['status']}", pace=pace.words()
            )
            if not console.is_terminal:
                said = (
                    f"[{pace.ended}/{pace.total}] {name}: {row['verdict'] or row['status']}; {pace.words()}"
                )
                console.print(said, highlight=False, markup=False, soft_wrap=True)


@contextlib.contextmanager
def _progress(console: Console, total: int) -> Iterator[Progress]:
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[pace]}", markup=False),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        bar.add_task("starting", total=total, pace="")
        yield bar
