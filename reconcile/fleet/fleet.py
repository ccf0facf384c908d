"""`reconcile fleet`: plans which axes to diagnose, runs them on a cluster, and writes table and page.

Results of an earlier run are used again while everything on which they depend is unchanged.
"""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from reconcile.errors import ReconcileError
from reconcile.fleet.cluster import Cluster
from reconcile.fleet.dataset import list_dataset
from reconcile.fleet.models import FleetModels
from reconcile.fleet.rows import Row, row_of_failure
from reconcile.fleet.store import PAGE, make_out, result_key, store_result, stored_row, write_table
from reconcile.fleet.task import AxisTask, diagnose_axis, program_version
from reconcile.formats.mapping import NO_MAPPING, Mapping
from servo_ctrl.files.diagnosis_files import MODEL_FILE, REPORT_FILE, VERDICT_FILE


class FleetOptions(NamedTuple):
    """How the axes are diagnosed, and whether their reports are stored."""

    mapping: Mapping = NO_MAPPING
    with_reports: bool = False


class FleetPlan(NamedTuple):
    """The axes of a fleet: finished rows, and tasks to run."""

    rows: dict[tuple[str, str], Row]
    """By machine and axis: rows of an earlier run, and of axes without a model."""
    tasks: list[AxisTask]
    reused: int
    """Rows of an earlier run."""
    ignored: list[str]
    """Files that belong to no axis."""


def plan_fleet(dataset: str, model_dir: Path, out: Path, options: FleetOptions) -> FleetPlan:
    """List the dataset, find the models and the results of an earlier run. Raises ReconcileError."""
    models = FleetModels(model_dir)
    listing = list_dataset(dataset)
    make_out(out)
    rows: dict[tuple[str, str], Row] = {}
    tasks: list[AxisTask] = []
    reused = 0
    wanted = (VERDICT_FILE, MODEL_FILE, REPORT_FILE) if options.with_reports else (VERDICT_FILE, MODEL_FILE)
    version = program_version()
    for data in listing.axes:
        name = data.machine, data.axis
        try:
            model = models.of(*name)
        except ReconcileError as error:
            rows[name] = row_of_failure(data, result_key(data), "no model", str(error))
            store_result(out, rows[name], {})
            continue
        key = result_key(data, model.text, options.mapping, version)
        row = stored_row(out, data, key, wanted=wanted)
        if row is not None:
            rows[name] = row
            reused += 1
            continue
        tasks.append(
            AxisTask(
                data=data,
                key=key,
                model_file=model.file,
                model=model.text,
                mapping=options.mapping,
                with_report=options.with_reports,
                version=version,
            )
        )
    return FleetPlan(rows, tasks, reused, listing.ignored)


def check_workers(cluster: Cluster) -> None:
    """Raise ReconcileError where a worker runs another version of the program."""
    own = program_version()
    versions = cluster.run_on_every_worker(program_version)
    wrong = {worker: version for worker, version in versions.items() if version != own}
    if wrong:
        worker, version = next(iter(wrong.items()))
        reason = f"{len(wrong)} workers have another reconcile: {version} at {worker}, here {own}"
        raise ReconcileError(cluster.address, "", reason, "install the same version on every worker")


def diagnose_fleet(
    planned: FleetPlan,
    out: Path,
    cluster: Cluster,
    limit_s: float,
    work: Callable[[Any], Any] = diagnose_axis,
) -> Iterator[Row]:
    """Run the tasks; each row is on disk before it is yielded. Raises ReconcileError, OSError."""
    for outcome in cluster.run(work, planned.tasks, limit_s):
        task = outcome.task
        row, files = outcome.value or (
            row_of_failure(task.data, task.key, outcome.failure, outcome.reason) | {"model": task.model_file},
            {},
        )
        store_result(out, row, files)
        planned.rows[task.data.machine, task.data.axis] = row
        yield row


def write_results(planned: FleetPlan, out: Path) -> tuple[Path, Path]:
    """Write the table of all axes, sorted by machine and axis, and the page; return both. Raises OSError."""
    from reconcile.fleet.page import write_page  # noqa: PLC0415  # workers need no plotly.js

    rows = [planned.rows[name] for name in sorted(planned.rows)]
    table, page = write_table(out, rows), out / PAGE
    write_page(rows, planned.ignored, page)
    return table, page
