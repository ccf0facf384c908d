"""MATLAB's .mat up to version 7."""

from pathlib import Path

import scipy.io

from reconcile.errors import ReconcileError, in_words
from reconcile.formats.array_files import table_of
from reconcile.formats.table import Table


def read(path: Path) -> Table:
    """Its arrays of numbers, those in structs as `struct.field`. Raises ReconcileError."""
    try:
        content = scipy.io.loadmat(path, simplify_cells=True, appendmat=False)
    except NotImplementedError as error:
        raise ReconcileError(
            path, "", "is a .mat file of version 7.3 (HDF5)", "save it again with -v7"
        ) from error
    except Exception as error:  # SciPy raises whatever a broken file leads to
        raise ReconcileError(path, "", f"is no readable .mat file: {in_words(error)}") from error
    return table_of(str(path), {name: value for name, value in content.items() if not name.startswith("__")})
