"""NumPy's .npz."""

from __future__ import annotations

import zipfile
import zlib
from typing import TYPE_CHECKING

import numpy as np

from reconcile.errors import ReconcileError
from reconcile.formats.array_files import table_of

if TYPE_CHECKING:
    from pathlib import Path

    from reconcile.formats.table import Table


def read(path: Path) -> Table:
    """Its arrays of numbers. Raises ReconcileError."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as content:
            arrays = {name: content[name] for name in content.files}
    except (OSError, ValueError, EOFError, TypeError, zipfile.BadZipFile, zlib.error) as error:
        raise ReconcileError(path, "", f"is no readable .npz file: {error}") from error
    return table_of(str(path), arrays)
