"""The results of a fleet on disk: a directory for each axis, and the table of all.

OUT/axes/MACHINE/AXIS/   verdict.json, model.toml, report.html
                         result.json: the row of the table; written last, so it shows that the others are
                         complete
OUT/results.parquet      all rows
OUT/fleet.html           the page
"""

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

from reconcile.errors import ReconcileError
from reconcile.fleet.dataset import AxisData
from reconcile.fleet.rows import COLUMNS, TRANSIENT, Row
from reconcile.formats.arrow_files import write_records
from servo_ctrl.files.diagnosis_files import MODEL_FILE, REPORT_FILE, VERDICT_FILE
from servo_ctrl.files.whole_file import write_whole

RESULT, TABLE, PAGE = "result.json", "results.parquet", "fleet.html"


def result_key(data: AxisData, *parts: Any) -> str:
    """Return the SHA-256 of all inputs of a result: name, size and version of the files, and `parts`."""
    content = json.dumps([data.machine, data.axis, data.files, *parts], ensure_ascii=True)
    return hashlib.sha256(content.encode()).hexdigest()


def axis_folder(machine: str, axis: str) -> str:
    """Return the directory of an axis below OUT; also its relative URL."""
    return f"axes/{quote(machine, safe='')}/{quote(axis, safe='')}"


def stored_row(out: Path, data: AxisData, key: str, *, wanted: Sequence[str] = ()) -> Row | None:
    """Return the row of an earlier run if its key and its `wanted` files still match; None otherwise."""
    directory = out / axis_folder(data.machine, data.axis)
    try:
        row = json.loads((directory / RESULT).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    if not isinstance(row, dict) or set(row) != set(COLUMNS) or row["key"] != key:
        return None
    complete = row["status"] != "diagnosed" or all((directory / name).is_file() for name in wanted)
    return row if complete and row["status"] not in TRANSIENT else None


def store_result(out: Path, row: Row, files: Mapping[str, bytes]) -> None:
    """Write the files of an axis, then its row. Raises OSError."""
    directory = out / axis_folder(row["machine"], row["axis"])
    directory.mkdir(parents=True, exist_ok=True)
    (directory / RESULT).unlink(missing_ok=True)  # while the other files change, they are not complete
    for name in (VERDICT_FILE, MODEL_FILE, REPORT_FILE):
        if name in files:
            _write(directory / name, files[name])
        else:
            (directory / name).unlink(missing_ok=True)
    _write(directory / RESULT, (json.dumps(row, indent=1, allow_nan=False) + "\n").encode())


def write_table(out: Path, rows: Sequence[Row]) -> Path:
    """Write all rows into one Parquet file. Raises OSError."""
    file = out / TABLE
    write_whole(file, lambda temporary: write_records(temporary, COLUMNS, rows))
    return file


def make_out(out: Path) -> None:
    """Create the directory of the results. Raises ReconcileError."""
    try:
        (out / "axes").mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ReconcileError(out, "", f"cannot be made: {error.strerror}") from None


def _write(path: Path, content: bytes) -> None:
    write_whole(path, lambda temporary: temporary.write_bytes(content))
