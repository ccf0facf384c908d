"""A single Parquet file; units are read from the field metadata (key `unit`)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pyarrow as pa
import pyarrow.parquet as pq

from reconcile.errors import ReconcileError
from reconcile.formats.arrow_columns import table_of

if TYPE_CHECKING:
    from pathlib import Path

    from reconcile.formats.table import Table


def read(path: Path) -> Table:
    """All columns; the ones that are no numbers as text. Raises ReconcileError."""
    try:
        content = pq.read_table(path)
    except (OSError, pa.ArrowException) as error:
        raise ReconcileError(
            path, "", f"is no readable Parquet file: {str(error).splitlines()[0]}"
        ) from error
    return table_of(str(path), content, first_row=0)
