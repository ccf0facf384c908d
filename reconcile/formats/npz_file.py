"""NumPy's .npz."""

from pathlib import Path

import numpy as np

from reconcile.errors import ReconcileError, in_words
from reconcile.formats.array_files import table_of
from reconcile.formats.table import Table


def read(path: Path) -> Table:
    """Its arrays of numbers. Raises ReconcileError."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as content:
            arrays = {name: content[name] for name in content.files}
    except Exception as error:  # NumPy and zipfile raise whatever a broken file leads to
        raise ReconcileError(path, "", f"is no readable .npz file: {in_words(error)}") from error
    return table_of(str(path), arrays)
