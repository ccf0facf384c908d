"""Parquet parts and CSV: pyarrow behind one file.

A part is written whole under a temporary name, synchronised to the disk and renamed: what has its name is
readable, whatever happens to the process.
"""

from __future__ import annotations

import contextlib
import os
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from servo_ctrl.telemetry.channels import Channel


def schema_of(channels: Sequence[Channel]) -> Any:
    """The Arrow schema of a recording; each field carries its unit and its meaning."""
    return pa.schema(
        [
            pa.field(
                channel.name,
                pa.from_numpy_dtype(np.dtype(channel.dtype)),
                metadata={"unit": channel.unit, "meaning": channel.meaning},
            )
            for channel in channels
        ]
    )


def write_part(path: Path, channels: Sequence[Channel], rows: np.ndarray[Any, np.dtype[np.float64]]) -> None:
    """Write rows (N, channels) as one Parquet file. Raises OSError."""
    columns = [rows[:, i].astype(channel.dtype) for i, channel in enumerate(channels)]
    table = pa.Table.from_arrays([pa.array(column) for column in columns], schema=schema_of(channels))
    write_whole(path, lambda temporary: pq.write_table(table, temporary))


def write_whole(path: Path, write: Callable[[Path], object]) -> None:
    """Let `write` fill a temporary file beside `path`, sync it, rename it. Raises OSError; leaves no rest."""
    temporary = path.with_name(path.name + ".tmp")
    try:
        write(temporary)
        _sync(temporary)
        temporary.replace(path)
        _sync(path.parent)
    except BaseException:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        raise


def read_parts(paths: Sequence[Path]) -> dict[str, np.ndarray[Any, np.dtype[Any]]]:
    """The columns of all parts, joined in the order given. Raises OSError and ValueError (not Parquet)."""
    try:
        table = pa.concat_tables([pq.read_table(path) for path in paths])
    except (OSError, ValueError):
        raise
    except Exception as error:  # Arrow raises whatever a broken file leads to
        raise ValueError(str(error) or repr(error)) from error
    return {name: table.column(name).to_numpy() for name in table.column_names}


def write_csv(path: Path, columns: dict[str, np.ndarray[Any, np.dtype[Any]]]) -> None:
    """Write columns with one header line; a missing value (NaN) is written as nan. Raises OSError."""
    table = pa.table(columns)
    write_whole(path, lambda temporary: pa.csv.write_csv(table, temporary))


def reason_of(error: OSError) -> str:
    """Why the system refused, in its own few words; pyarrow's are a paragraph."""
    return os.strerror(error.errno) if error.errno else str(error)


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
