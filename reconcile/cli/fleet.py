"""`reconcile fleet`: many axes of many machines, on the processors of this computer or of a cluster."""

from pathlib import Path
from typing import Annotated

import typer

from reconcile.cli.options import MappingOption

DatasetArgument = Annotated[
    str, typer.Argument(help="Directory, or URL that fsspec reads, of the recordings.")
]
ModelDirOption = Annotated[Path, typer.Option(help="MACHINE/AXIS.toml, MACHINE.toml, or default.toml.")]
OutOption = Annotated[Path, typer.Option(help="Directory for the results; a second run goes on in it.")]
SchedulerOption = Annotated[
    str | None, typer.Option(help="Address of a Dask scheduler: tcp://HOST:8786. Else a local cluster.")
]
WorkersOption = Annotated[
    int | None, typer.Option(min=1, help="Processes of the local cluster; by default one a processor.")
]
MemoryOption = Annotated[
    str, typer.Option(help="Largest memory of a local worker, such as 2GiB; auto: its share.")
]
LimitOption = Annotated[float, typer.Option(min=1.0, help="Longest time for one axis, in seconds.")]
ReportsOption = Annotated[
    bool, typer.Option("--reports/--no-reports", help="Keep report.html of every axis, 6 MB each.")
]


def fleet(
    dataset: DatasetArgument,
    model_dir: ModelDirOption,
    out: OutOption = Path("out/fleet"),
    scheduler: SchedulerOption = None,
    workers: WorkersOption = None,
    memory: MemoryOption = "auto",
    limit_s: LimitOption = 600.0,
    mapping: MappingOption = None,
    reports: ReportsOption = False,
) -> None:
    """Diagnose every axis of many machines, and list which machines share which missing physics.

    The recordings lie as partitioned Parquet, one directory an axis, any number of files in each:

        fleet/machine=mill-1/axis=x/monday.parquet

        reconcile fleet fleet --model-dir models --out out/fleet

    A file that cannot be used is reported and left out; so is an axis without a model, one that takes too
    long, and one whose workers die. Every axis is written when it is done: after Ctrl-C, a crash or with new
    recordings the same command does only what is missing or has changed.

    OUT/results.parquet has a row for each axis, OUT/fleet.html shows them, OUT/axes/MACHINE/AXIS has the
    verdict and the repaired model of each.

    Exit codes: 0 the table is written, whatever became of single axes; 1 dataset, models, cluster or OUT
    cannot be used; 2 wrong use of the command; 130 interrupted by Ctrl-C, axes that were done are kept.
    """
    import os

    from rich.console import Console

    from reconcile.cli.fleet_progress import results_text, show_rows
    from reconcile.fleet.cluster import cluster_at, local_cluster
    from reconcile.fleet.fleet import FleetOptions, check_workers, diagnose_fleet, plan_fleet, write_results
    from reconcile.formats.mapping import parse_mapping

    console = Console(stderr=True)
    options = FleetOptions(parse_mapping(mapping or []), reports)
    with console.status("listing the dataset"):
        planned = plan_fleet(dataset, model_dir, out, options)
    total = len(planned.rows) + len(planned.tasks)
    console.print(
        f"{total} axes: {planned.reused} done before, {len(planned.tasks)} to do",
        highlight=False,
        markup=False,
    )
    if planned.tasks:
        processes = min(workers or os.cpu_count() or 1, len(planned.tasks))
        with cluster_at(scheduler) if scheduler else local_cluster(processes, memory) as cluster:
            check_workers(cluster)
            show_rows(diagnose_fleet(planned, out, cluster, limit_s), len(planned.tasks), console)
    table, page = write_results(planned, out)
    typer.echo(results_text([planned.rows[name] for name in sorted(planned.rows)]))
    typer.echo(f"results: {table}\npage: {page}")
