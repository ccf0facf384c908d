"""Columns from named arrays: NumPy's .npz, and MATLAB's .mat up to version 7.

A matrix with many rows and few columns becomes `name.0`, `name.1`, ...; a struct `name.field`; a scalar
becomes a column of one value (for `force_per_volt`).
"""

from pathlib import Path
from typing import Any

import numpy as np
import scipy.io

from reconcile.errors import ReconcileError, in_words
from reconcile.formats.table import Column, Table

MAX_COLUMNS = 64
"""Most columns of a matrix of channels; chosen: more than one machine records."""


def read_npz(path: Path) -> Table:
    """Read the arrays of numbers of an .npz file. Raises ReconcileError."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as content:
            arrays = dict(content)
    except Exception as error:  # NumPy and zipfile raise whatever a broken file leads to
        raise ReconcileError(path, "", f"is not a readable .npz file: {in_words(error)}") from error
    return _table(path, arrays)


def read_mat(path: Path) -> Table:
    """Read the arrays of numbers of a .mat file. Raises ReconcileError."""
    try:
        content = scipy.io.loadmat(path, simplify_cells=True, appendmat=False)
    except NotImplementedError as error:
        reason = "is a .mat file of version 7.3 (HDF5)"
        raise ReconcileError(path, "", reason, "save it again with -v7") from error
    except Exception as error:  # SciPy raises whatever a broken file leads to
        raise ReconcileError(path, "", f"is not a readable .mat file: {in_words(error)}") from error
    return _table(path, {name: value for name, value in content.items() if not name.startswith("__")})


def _table(path: Path, arrays: dict[str, Any]) -> Table:
    """Convert every array of real numbers to columns; others are listed as ignored."""
    columns: dict[str, Column] = {}
    ignored: list[str] = []
    for name, value in _flattened(arrays).items():
        values = np.asarray(value)
        if values.dtype.kind not in "fiub" or values.ndim > 2 or values.size == 0:
            ignored.append(name)
            continue
        values = np.atleast_1d(np.squeeze(values.astype(np.float64)))
        if values.ndim == 1:
            columns[name] = Column(values)
        elif min(values.shape) > MAX_COLUMNS:
            ignored.append(name)
        else:
            channels = values.T if values.shape[0] >= values.shape[1] else values
            columns |= {f"{name}.{i}": Column(channel.copy()) for i, channel in enumerate(channels)}
    return Table(str(path), columns, ignored=tuple(ignored))


def _flattened(arrays: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Flatten structs (dictionaries) to `struct.field`."""
    flat: dict[str, Any] = {}
    for name, value in arrays.items():
        flat |= _flattened(value, f"{prefix}{name}.") if isinstance(value, dict) else {prefix + name: value}
    return flat
