"""Columns from named arrays, as .npz and .mat files hold them.

A matrix with many rows and few columns becomes `name.0`, `name.1`, ...; a struct `name.field`; a scalar is
kept as a column of one value (for `force_per_volt`).
"""

from typing import Any

import numpy as np

from reconcile.formats.table import Column, Table

MOST_COLUMNS = 64
"""Columns of a matrix beyond which it is no set of channels."""


def table_of(source: str, arrays: dict[str, Any]) -> Table:
    """Convert every array of real numbers to columns; others are listed as ignored."""
    columns: dict[str, Column] = {}
    ignored: list[str] = []
    for name, value in flattened(arrays).items():
        values = np.asarray(value)
        if values.dtype.kind not in "fiub" or values.ndim > 2 or values.size == 0:
            ignored.append(name)
            continue
        values = np.atleast_1d(np.squeeze(values.astype(np.float64)))
        if values.ndim == 1:
            columns[name] = Column(values)
            continue
        values = values if values.shape[0] >= values.shape[1] else values.T
        if values.shape[1] > MOST_COLUMNS:
            ignored.append(name)
            continue
        columns |= {f"{name}.{i}": Column(values[:, i].copy()) for i in range(values.shape[1])}
    return Table(source, columns, ignored=tuple(ignored))


def flattened(arrays: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Flatten structs (dictionaries) to `struct.field`."""
    flat: dict[str, Any] = {}
    for name, value in arrays.items():
        if isinstance(value, dict):
            flat |= flattened(value, f"{prefix}{name}.")
        else:
            flat[prefix + name] = value
    return flat
