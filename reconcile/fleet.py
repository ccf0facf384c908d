"""`reconcile fleet`: the diagnosis of every axis of many machines; what is done once is not done again."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from reconcile.errors import ReconcileError
from reconcile.fleet_dataset import list_dataset
from reconcile.fleet_models import FleetModels
from reconcile.fleet_rows import row_of_failure
from reconcile.fleet_store import PAGE, keep, kept_row, key_of, make_out, write_table
from reconcile.fleet_task import MODEL, REPORT, VERDICT, AxisTask, diagnose_axis, identity
from reconcile.formats.mapping import Mapping

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from reconcile.fleet_cluster import Cluster
    from reconcile.fleet_rows import Row


class FleetOptions(NamedTuple):
    """How the axes are to be diagnosed, and what of each is kept."""

    mapping: Mapping = Mapping()
    with_reports: bool = False
    limit_s: float = 600.0
    """For one axis."""


class Plan(NamedTuple):
    """What there is to do in a fleet."""

    rows: dict[tuple[str, str], Row]
    """Of an earlier run, and of axes without a model."""
    tasks: list[AxisTask]
    kept: int
    """How many rows are of an earlier run."""
    ignored: list[str]
    """Files that belong to no axis."""


def plan(
    dataset: str,
    model_dir: Path,
    out: Path,
    options: FleetOptions,
    on_machine: Callable[[int], None] = lambda _count: None,
) -> Plan:
    """List the dataset, find the models, and what an earlier run has left. Raises ReconcileError."""
    models = FleetModels(model_dir)
    listing = list_dataset(dataset, on_machine)
    make_out(out)
    rows: dict[tuple[str, str], Row] = {}
    tasks: list[AxisTask] = []
    wanted = (VERDICT, MODEL, REPORT) if options.with_reports else (VERDICT, MODEL)
    kept = 0
    for data in listing.axes:
        name = data.machine, data.axis
        try:
            model = models.of(*name)
        except ReconcileError as error:
            rows[name] = row_of_failure(data, key_of(data), "no model", str(error))
            keep(out, rows[name], {})
            continue
        key = key_of(data, model.text, options.mapping, identity())
        row = kept_row(out, data, key, wanted=wanted)
        if row is not None:
            rows[name] = row
            kept += 1
        else:
            tasks.append(
                AxisTask(data, key, model.file, model.text, options.mapping, options.with_reports, identity())
            )
    return Plan(rows, tasks, kept, listing.ignored)


def check_workers(cluster: Cluster) -> None:
    """Raise ReconcileError where a worker would answer by another version."""
    wrong = {worker: said for worker, said in cluster.everywhere(identity).items() if said != identity()}
    if wrong:
        worker, said = next(iter(wrong.items()))
        reason = f"{len(wrong)} workers have another reconcile: {said} at {worker}, here {identity()}"
        raise ReconcileError(cluster.address, "", reason, "install the same version on every worker")


def diagnose_fleet(
    planned: Plan,
    out: Path,
    cluster: Cluster,
    limit_s: float,
    work: Callable[[Any], Any] = diagnose_axis,
) -> Iterator[Row]:
    """Do what is to be done; each row is on the disk before it is told. Raises ReconcileError, OSError."""
    for ended in cluster.run(work, planned.tasks, limit_s):
        task = ended.task
        row, files = ended.value or (
            row_of_failure(task.data, task.key, ended.failure, ended.reason) | {"model": task.model_file},
            {},
        )
        keep(out, row, files)
        planned.rows[task.data.machine, task.data.axis] = row
        yield row


def finish(planned: Plan, out: Path) -> tuple[Path, Path]:
    """The table of all axes by machine and axis, and the page. Raises OSError."""
    from reconcile.fleet_page import write_page  # noqa: PLC0415  # plotly.js is not for the workers

    rows = [planned.rows[name] for name in sorted(planned.rows)]
    table, page = write_table(out, rows), out / PAGE
    write_page(rows, planned.ignored, page)
    return table, page
