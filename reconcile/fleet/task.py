"""Diagnoses one axis of one machine, from its files to a row of the table. Runs in a worker."""

import hashlib
import json
import time
from collections.abc import Sequence
from functools import cache
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import hil_sim
import kernels
from reconcile.diagnosis.diagnose import diagnose
from reconcile.errors import ReconcileError
from reconcile.fleet.dataset import AxisData, fetch_recordings
from reconcile.fleet.rows import Row, row_of_failure, row_of_verdict
from reconcile.formats.mapping import Mapping
from reconcile.formats.toml_file import document_of, toml_text, with_absolute_paths
from servo_ctrl.errors import reason_of
from servo_ctrl.files.diagnosis_files import MODEL_FILE, REPORT_FILE, VERDICT_FILE

OTHER_ROOMS = ("api/", "fleet/", "cli/", "trials/", "watch/", "loop/", "examples/", "runner/")
"""Directories with sources on which no verdict depends."""


class AxisTask(NamedTuple):
    """Everything that a worker needs to diagnose one axis, except the recordings."""

    data: AxisData
    key: str
    """Digest of everything on which the result depends."""
    model_file: str
    model: str
    """Text of the model file."""
    mapping: Mapping
    with_report: bool
    version: str
    """`program_version` of the sender; a worker of another version must refuse."""


class AxisResult(NamedTuple):
    """A row of the table, and the files to store by name."""

    row: Row
    files: dict[str, bytes]


@cache
def program_version() -> str:
    """Return the version with a digest of the sources on which a verdict depends."""
    digest = hashlib.sha256()
    others = [Path(package.__file__ or "").parent for package in (hil_sim, kernels)]
    for root in (Path(__file__).parents[1], *others):
        for file in sorted(root.rglob("*.py")):
            name = file.relative_to(root).as_posix()
            if not name.startswith(OTHER_ROOMS):
                digest.update(name.encode() + b"\0" + file.read_bytes())
    return f"{version('servo-ctrl')}+{digest.hexdigest()[:12]}"


def diagnose_axis(task: AxisTask) -> AxisResult:
    """Diagnose the readable recordings of an axis; its row reports files that are not readable."""
    started_s = time.perf_counter()
    if program_version() != task.version:
        reason = f"the worker has reconcile {program_version()}, the fleet was started with {task.version}"
        raise ReconcileError(task.data.name, "", reason, "install the same version on every worker")
    with TemporaryDirectory(prefix="reconcile-fleet-") as name:
        scratch = Path(name)
        status, reason = "", ""
        try:
            result = _diagnose(task, scratch)
        except ReconcileError as error:
            status, reason = "unusable", _with_user_paths(task, error, scratch)
        except OSError as error:
            status, reason = "unreadable", f"cannot be read: {reason_of(error)}"
        except Exception as error:  # noqa: BLE001  # one axis that fails is a row, not the end of the fleet
            status, reason = "failed", f"{type(error).__name__}: {error}"
    if status:
        result = AxisResult(row_of_failure(task.data, task.key, status, reason), {})
    result.row["model"] = task.model_file
    result.row["seconds"] = time.perf_counter() - started_s
    return result


def _diagnose(task: AxisTask, scratch: Path) -> AxisResult:
    """Diagnose the axis; exclude one unusable file after another as long as others remain."""
    (scratch / "model").mkdir()
    model, out = scratch / "model" / Path(task.model_file).name, scratch / "out"
    model.write_text(task.model, encoding="utf-8")
    paths = fetch_recordings(task.data, scratch / "recordings")
    bad: list[dict[str, str]] = []
    while True:
        try:
            diagnose(paths, model, out, task.mapping, with_report=task.with_report, set_aside=False)
        except ReconcileError as error:
            culprit = _culprit(error, paths)
            if culprit is None or len(paths) == 1:
                raise
            paths.remove(culprit)
            bad.append({"file": _relative(task, culprit, scratch), "reason": _reason(error)})
        else:
            break
    text = (
        (out / VERDICT_FILE).read_text(encoding="utf-8").replace(str(scratch / "recordings"), task.data.root)
    )
    row = row_of_verdict(task.data, task.key, json.loads(text), bad, recordings=len(paths))
    files = {VERDICT_FILE: text.encode(), MODEL_FILE: _with_absolute_paths(out / MODEL_FILE)}
    if task.with_report:
        files[REPORT_FILE] = (out / REPORT_FILE).read_bytes()
    return AxisResult(row, files)


def _culprit(error: ReconcileError, paths: Sequence[Path]) -> Path | None:
    """Return the recording that an error is about; its source may end with a time interval in brackets."""
    about = [path for path in paths if error.file == str(path) or error.file.startswith(f"{path} [")]
    return max(about, key=lambda path: len(str(path)), default=None)


def _relative(task: AxisTask, path: Path, scratch: Path) -> str:
    """Return the path of a recording relative to the directory of its axis in the dataset."""
    for base in (str(scratch / "recordings"), task.data.root.removeprefix("file://")):
        if str(path).startswith(f"{base}/"):
            return str(path)[len(base) + 1 :]
    return path.name


def _with_user_paths(task: AxisTask, error: ReconcileError, scratch: Path) -> str:
    """Return the text of an error with the paths that the user knows."""
    text = str(error).replace(str(scratch / "recordings"), task.data.root)
    return text.replace(str(scratch / "model" / Path(task.model_file).name), task.model_file)


def _reason(error: ReconcileError) -> str:
    """Return the text of an error without its file."""
    place = ": ".join(part for part in (error.where, error.reason) if part)
    return "; ".join(part for part in (place, error.remedy) if part)


def _with_absolute_paths(file: Path) -> bytes:
    """Return the repaired model with absolute paths, because it is stored in another directory."""
    document = with_absolute_paths(document_of(file), file.parent)
    return ("# Written by reconcile fleet.\n" + toml_text(document)).encode()
