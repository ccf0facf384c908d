"""Parquet and CSV through Arrow, and tables of records as Parquet: pyarrow behind one file."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq

from reconcile.errors import ReconcileError, in_words
from reconcile.formats.table import Column, Table
from servo_ctrl.errors import first_line

MISSING = ["", "nan", "NaN", "NAN", "null", "NULL", "NA", "n/a", "-", "inf", "-inf"]
"""Cells of a CSV file that hold no value."""
ROW_GROUP = 10_000
"""Rows of a Parquet row group, and so in memory at a time; chosen."""

pa.set_memory_pool(pa.system_memory_pool())  # Arrow's own pool would not give the memory of a long file back


def read_parquet(path: Path) -> Table:
    """Read a Parquet file; units are those of the field metadata (key `unit`). Raises ReconcileError."""
    try:
        content = pq.read_table(path)
    except Exception as error:  # Arrow raises whatever a broken file leads to
        raise ReconcileError(path, "", f"is not a readable Parquet file: {in_words(error)}") from error
    return _table(path, content, first_row=0)


def parse_csv(
    path: Path, body: memoryview, names: list[str], delimiter: str, first_row: int, decimal: str
) -> Table:
    """Parse the rows of a CSV file in UTF-8; the first is line `first_row`. Raises ReconcileError."""
    try:
        content = pa.csv.read_csv(
            pa.BufferReader(pa.py_buffer(body)),
            read_options=pa.csv.ReadOptions(column_names=names, use_threads=False),
            parse_options=pa.csv.ParseOptions(
                delimiter=delimiter,
                invalid_row_handler=lambda row: "skip" if (row.text or "").startswith("#") else "error",
            ),
            convert_options=pa.csv.ConvertOptions(
                null_values=MISSING, strings_can_be_null=True, decimal_point=decimal
            ),
        )
    except pa.ArrowException as error:
        where = f"rows from {first_row} on"
        raise ReconcileError(path, where, f"cannot be read: {first_line(error)}") from error
    return _table(path, content, first_row)


def write_table(path: Path, content: Any) -> None:
    """Write a table of Arrow, pandas or polars, or arrays (n,) by name, as Parquet. Raises ReconcileError."""
    try:
        pq.write_table(pa.table(content), path)
    except (TypeError, ValueError, pa.ArrowException) as error:
        wanted = "give a DataFrame, an Arrow table or arrays by name, all of one length"
        raise ReconcileError(
            type(content).__name__, "", f"is not a table: {in_words(error)}", wanted
        ) from error


def write_records(path: Path, types: Mapping[str, Any], records: Sequence[Mapping[str, Any]]) -> None:
    """Write records as Parquet. Raises OSError.

    `types`: column -> name of an Arrow type, `[type]` for a list, a dict of fields for a struct.
    """
    schema = pa.schema([(name, _arrow_type(kind)) for name, kind in types.items()])
    with pq.ParquetWriter(path, schema, compression="zstd") as writer:
        for first in range(0, max(len(records), 1), ROW_GROUP):
            part = list(records[first : first + ROW_GROUP])
            writer.write_table(pa.Table.from_pylist(part, schema=schema))


def _arrow_type(kind: Any) -> Any:
    match kind:
        case [item]:
            return pa.list_(_arrow_type(item))
        case dict():
            return pa.struct([(name, _arrow_type(field)) for name, field in kind.items()])
    return pa.type_for_alias(kind)


def _table(path: Path, content: Any, first_row: int) -> Table:
    """Convert numbers to float64 (null is NaN) with the unit of the field's metadata, others to text."""
    columns: dict[str, Column] = {}
    text: dict[str, list[str]] = {}
    for field in content.schema:
        chunks = content.column(field.name)
        if pa.types.is_timestamp(field.type):
            instants_ns = chunks.cast(pa.timestamp("ns"), safe=False).cast(pa.int64()).to_numpy()
            columns[field.name] = Column((instants_ns - instants_ns[:1]) * 1e-9, "s")
        elif _is_numeric(field.type):
            unit = (field.metadata or {}).get(b"unit", b"").decode("utf-8", "replace")
            values = np.asarray(chunks.cast(pa.float64(), safe=False).to_numpy(), dtype=np.float64)
            columns[field.name] = Column(values, unit)
        else:
            text[field.name] = [str(value) for value in chunks.to_pylist()]
    return Table(str(path), columns, text, first_row)


def _is_numeric(kind: Any) -> bool:
    """Whether values of an Arrow type are numbers; the null type counts, as NaN."""
    types = pa.types
    tests = (types.is_integer, types.is_floating, types.is_boolean, types.is_decimal, types.is_null)
    return any(test(kind) for test in tests)
