"""Columns from Arrow tables, which Parquet and CSV are read into."""

from typing import Any

import numpy as np
import pyarrow as pa

from reconcile.formats.table import Column, Table


def table_of(source: str, content: Any, first_row: int) -> Table:
    """Convert numbers to float64 (null is NaN) with the unit of the field's metadata, others to text."""
    columns: dict[str, Column] = {}
    text: dict[str, list[str]] = {}
    for field in content.schema:
        chunks = content.column(field.name)
        if numeric(field.type):
            unit = (field.metadata or {}).get(b"unit", b"").decode("utf-8", "replace")
            values = np.asarray(chunks.cast(pa.float64(), safe=False).to_numpy(), dtype=np.float64)
            columns[field.name] = Column(values, unit)
        else:
            text[field.name] = [str(value) for value in chunks.to_pylist()]
    return Table(source, columns, text, first_row)


def numeric(kind: Any) -> bool:
    """Whether values of an Arrow type are numbers; the null type counts, as NaN."""
    return bool(
        pa.types.is_integer(kind)
        or pa.types.is_floating(kind)
        or pa.types.is_boolean(kind)
        or pa.types.is_decimal(kind)
        or pa.types.is_null(kind)
    )
