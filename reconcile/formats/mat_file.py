"""MATLAB's .mat up to version 7."""

from __future__ import annotations

import zlib
from typing import TYPE_CHECKING

import scipy.io
from scipy.io.matlab import MatReadError

from reconcile.errors import ReconcileError
from reconcile.formats.array_files import table_of

if TYPE_CHECKING:
    from pathlib import Path

    from reconcile.formats.table import Table


def read(path: Path) -> Table:
    """Its arrays of numbers, those in structs as `struct.field`. Raises ReconcileError."""
    try:
        content = scipy.io.loadmat(path, simplify_cells=True, appendmat=False)
    except NotImplementedError as error:
        raise ReconcileError(
            path, "", "is a .mat file of version 7.3 (HDF5)", "save it again with -v7"
        ) from error
    except (OSError, ValueError, TypeError, EOFError, zlib.error, MatReadError) as error:
        raise ReconcileError(path, "", f"is no readable .mat file: {error}") from error
    return table_of(str(path), {name: value for name, value in content.items() if not name.startswith("__")})
