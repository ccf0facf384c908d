"""One axis of one machine, from its files to a row of the fleet's table. Runs in a worker."""

from __future__ import annotations

import hashlib
import json
import time
import tomllib
from functools import cache
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, NamedTuple

import tomli_w

import hil_sim
import reconcile
from reconcile.diagnose import diagnose
from reconcile.errors import ReconcileError
from reconcile.fleet_dataset import fetch
from reconcile.fleet_rows import row_of_failure, row_of_verdict
from reconcile.recording import ReadOptions
from servo_ctrl.telemetry.parquet import reason_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from reconcile.fleet_dataset import AxisData
    from reconcile.fleet_rows import Row
    from reconcile.formats.mapping import Mapping

VERDICT, MODEL, REPORT = "verdict.json", "model.toml", "report.html"


class AxisTask(NamedTuple):
    """All that a worker needs for one axis, but the recordings."""

    data: AxisData
    key: str
    """Of everything that the result depends on."""
    model_file: str
    model: str
    """Text of the model file."""
    mapping: Mapping
    with_report: bool
    identity: str
    """Of the program that sent it: a worker of another version must not answer."""


class AxisResult(NamedTuple):
    """What comes back: a row, and the files to keep by name."""

    row: Row
    files: dict[str, bytes]


@cache
def identity() -> str:
    """Version and a digest of the sources that a verdict depends on; the same on every worker."""
    digest = hashlib.sha256()
    for package in (reconcile, hil_sim):
        root = Path(package.__file__ or "").parent
        for file in sorted(root.rglob("*.py")):
            name = file.relative_to(root).as_posix()
            if not name.startswith(("fleet", "cli/", "trial", "watch", "example", "runner/")):
                digest.update(name.encode() + b"\0" + file.read_bytes())
    return f"{version('servo-ctrl')}+{digest.hexdigest()[:12]}"


def diagnose_axis(task: AxisTask) -> AxisResult:
    """Diagnose what is readable of the axis; a file that is not is reported in its row."""
    started_s = time.perf_counter()
    if identity() != task.identity:
        reason = f"the worker has reconcile {identity()}, the fleet was started with {task.identity}"
        raise ReconcileError(task.data.name, "", reason, "install the same version on every worker")
    with TemporaryDirectory(prefix="reconcile-fleet-") as name:
        scratch = Path(name)
        try:
            found = _diagnosed(task, scratch)
        except ReconcileError as error:
            found = AxisResult(
                row_of_failure(task.data, task.key, "unusable", _said(task, error, scratch)), {}
            )
        except OSError as error:
            reason = f"cannot be read: {reason_of(error)}"
            found = AxisResult(row_of_failure(task.data, task.key, "unreadable", reason), {})
        except Exception as error:  # noqa: BLE001  # one axis that fails is a row, not the end of the fleet
            reason = f"{type(error).__name__}: {error}"
            found = AxisResult(row_of_failure(task.data, task.key, "failed", reason), {})
    found.row["model"] = task.model_file
    found.row["seconds"] = time.perf_counter() - started_s
    return found


def _diagnosed(task: AxisTask, scratch: Path) -> AxisResult:
    (scratch / "model").mkdir()
    model, out = scratch / "model" / Path(task.model_file).name, scratch / "out"
    model.write_text(task.model, encoding="utf-8")
    paths = fetch(task.data, scratch / "recordings")
    bad: list[dict[str, str]] = []
    while True:
        try:
            diagnose(paths, model, out, ReadOptions(task.mapping), with_report=task.with_report)
        except ReconcileError as error:
            culprit = _culprit(error, paths)
            if culprit is None or len(paths) == 1:
                raise
            paths.remove(culprit)
            bad.append({"file": _below(task, culprit, scratch), "reason": _why(error)})
        else:
            break
    text = (out / VERDICT).read_text(encoding="utf-8").replace(str(scratch / "recordings"), task.data.root)
    row = row_of_verdict(task.data, task.key, json.loads(text), bad, recordings=len(paths))
    files = {VERDICT: text.encode(), MODEL: _with_absolute_paths(out / MODEL)}
    if task.with_report:
        files[REPORT] = (out / REPORT).read_bytes()
    return AxisResult(row, files)


def _culprit(error: ReconcileError, paths: Sequence[Path]) -> Path | None:
    """The recording that a reason is about; sources are named with the stretch behind them."""
    about = [path for path in paths if error.file == str(path) or error.file.startswith(f"{path} [")]
    return max(about, key=lambda path: len(str(path)), default=None)


def _below(task: AxisTask, path: Path, scratch: Path) -> str:
    """A file as it stands in the dataset, below the directory of its axis."""
    for base in (str(scratch / "recordings"), task.data.root.removeprefix("file://")):
        if str(path).startswith(f"{base}/"):
            return str(path)[len(base) + 1 :]
    return path.name


def _said(task: AxisTask, error: ReconcileError, scratch: Path) -> str:
    """A reason with the names that the user knows."""
    text = str(error).replace(str(scratch / "recordings"), task.data.root)
    return text.replace(str(scratch / "model" / Path(task.model_file).name), task.model_file)


def _why(error: ReconcileError) -> str:
    """A reason without the file, which stands beside it."""
    place = ": ".join(part for part in (error.where, error.reason) if part)
    return "; ".join(part for part in (place, error.remedy) if part)


def _with_absolute_paths(file: Path) -> bytes:
    """The repaired model; it was written elsewhere than it will lie."""
    document = tomllib.loads(file.read_text(encoding="utf-8"))
    for axis in document["axis"].values():
        for section in axis.values():
            if isinstance(section, dict) and isinstance(section.get("eds"), str):
                section["eds"] = str((file.parent / section["eds"]).resolve())
    return ("# Written by reconcile fleet.\n" + tomli_w.dumps(document)).encode()
