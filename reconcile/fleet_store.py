"""What a fleet leaves on the disk: a directory an axis, each whole or not there, and the table of all.

OUT/axes/MACHINE/AXIS/result.json     its row; written last: where it is, the others are
                      verdict.json, model.toml, report.html
OUT/results.parquet
OUT/fleet.html
"""

from __future__ import annotations

import hashlib
import json
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import pyarrow as pa
import pyarrow.parquet as pq

from reconcile.errors import ReconcileError
from reconcile.fleet_rows import SCHEMA, TRANSIENT
from servo_ctrl.telemetry.parquet import write_whole

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from reconcile.fleet_dataset import AxisData
    from reconcile.fleet_rows import Row

RESULT, TABLE, PAGE = "result.json", "results.parquet", "fleet.html"
ROWS_A_GROUP = 10_000


def key_of(data: AxisData, *parts: Any) -> str:
    """SHA-256 of everything that a result depends on: the files' names, sizes and marks, and `parts`."""
    content = json.dumps([data.machine, data.axis, data.files, *parts], ensure_ascii=True)
    return hashlib.sha256(content.encode()).hexdigest()


def folder(machine: str, axis: str) -> str:
    """Where the axis is below OUT; also a relative address."""
    return f"axes/{quote(machine, safe='')}/{quote(axis, safe='')}"


def kept_row(out: Path, data: AxisData, key: str, *, wanted: Sequence[str] = ()) -> Row | None:
    """The row of an earlier run that still holds; None where the axis is to be done."""
    directory = out / folder(data.machine, data.axis)
    try:
        row = json.loads((directory / RESULT).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    if not isinstance(row, dict) or set(row) != set(SCHEMA.names) or row["key"] != key:
        return None
    complete = row["status"] != "diagnosed" or all((directory / name).is_file() for name in wanted)
    return row if complete and row["status"] not in TRANSIENT else None


def keep(out: Path, row: Row, files: Mapping[str, bytes]) -> None:
    """Write the files of an axis, then its row. Raises OSError."""
    directory = out / folder(row["machine"], row["axis"])
    directory.mkdir(parents=True, exist_ok=True)
    (directory / RESULT).unlink(missing_ok=True)  # what it said is about to change
    for name in ("verdict.json", "model.toml", "report.html"):
        if name in files:
            _write(directory / name, files[name])
        else:
            (directory / name).unlink(missing_ok=True)
    _write(directory / RESULT, (json.dumps(row, indent=1, allow_nan=False) + "\n").encode())


def write_table(out: Path, rows: Sequence[Row]) -> Path:
    """All rows as one Parquet file. Raises OSError."""
    file = out / TABLE

    def write(temporary: Path) -> None:
        with pq.ParquetWriter(temporary, SCHEMA, compression="zstd") as writer:
            for first in range(0, max(len(rows), 1), ROWS_A_GROUP):
                part = list(rows[first : first + ROWS_A_GROUP])
                writer.write_table(pa.Table.from_pylist(part, schema=SCHEMA))

    write_whole(file, write)
    return file


def make_out(out: Path) -> None:
    """Make the directory. Raises ReconcileError."""
    try:
        (out / "axes").mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ReconcileError(out, "", f"cannot be made: {error.strerror}") from None


def _write(path: Path, content: bytes) -> None:
    write_whole(path, lambda temporary: temporary.write_bytes(content))
