"""A single Parquet file; units are read from the field metadata (key `unit`)."""

from pathlib import Path

import pyarrow.parquet as pq

from reconcile.errors import ReconcileError, in_words
from reconcile.formats.arrow_columns import table_of
from reconcile.formats.table import Table


def read(path: Path) -> Table:
    """All columns; the ones that are no numbers as text. Raises ReconcileError."""
    try:
        content = pq.read_table(path)
    except Exception as error:  # Arrow raises whatever a broken file leads to
        raise ReconcileError(path, "", f"is no readable Parquet file: {in_words(error)}") from error
    return table_of(str(path), content, first_row=0)
