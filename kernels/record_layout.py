"""The memory layout that a NamedTuple declares, in numpy's structured arrays.

A field is a `float`, `int` or `bool`, another NamedTuple, or a `Table`. Tables have no fixed size: their
numbers are in one pool beside the records, and a record holds the place in the pool.
"""

from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple, get_type_hints

import numpy as np
from numpy.typing import NDArray

Table = NDArray[np.float64]
"""(rows, columns), C-contiguous."""
Pool = NDArray[np.float64]
"""(n,): the numbers of all tables of several records."""


class Place(NamedTuple):
    """The place of a table in the pool."""

    start: int
    rows: int
    columns: int


SCALARS: dict[Any, Any] = {float: np.float64, int: np.int64, bool: np.bool_}
"""The types of single numbers, and how numpy stores them."""


@cache
def kinds_of(declaration: Any) -> dict[str, Any]:
    """Return the type of each field in order: `float`, `int`, `bool`, `Table` or another declaration.

    Raises:
        TypeError: a field is none of these.

    """
    fields = get_type_hints(declaration)
    for name, kind in fields.items():
        if kind not in SCALARS and kind != Table and not _is_declaration(kind):
            raise TypeError(f"{declaration.__qualname__}.{name}: a record cannot hold {kind}")
    return fields


def _is_declaration(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, tuple) and hasattr(kind, "_fields")


@cache
def record_type(declaration: Any) -> np.dtype[Any]:
    """Return the C-aligned layout of a declaration, with the same field names."""
    layout: list[tuple[str, Any]] = []
    for name, kind in kinds_of(declaration).items():
        if kind in SCALARS:
            layout.append((name, SCALARS[kind]))
        else:
            layout.append((name, record_type(Place if kind == Table else kind)))
    return np.dtype(layout, align=True)


def store(records: NDArray[Any], values: Sequence[tuple[Any, ...]]) -> Pool:
    """Write one value into each of the records (n,); return the pool of their tables."""
    tables: list[Table] = []
    for index, value in enumerate(values):
        records[index] = numbers_of(value, tables)
    return np.concatenate([np.zeros(0), *(table.ravel() for table in tables)])


def numbers_of(value: Any, tables: list[Table]) -> tuple[Any, ...]:
    """Convert a value to nested tuples that numpy can write to a record; append its tables to `tables`."""
    declaration: Any = type(value)
    numbers: list[Any] = []
    for name, kind in kinds_of(declaration).items():
        field = getattr(value, name)
        if kind == Table:
            start = sum(table.size for table in tables)
            tables.append(np.ascontiguousarray(field, dtype=np.float64))
            numbers.append(Place(start, *tables[-1].shape))
        else:
            numbers.append(field if kind in SCALARS else numbers_of(field, tables))
    return tuple(numbers)


@cache
def is_flat(declaration: Any) -> bool:
    """Whether a declaration has only numbers, so that numpy reads and writes its values directly."""
    return all(kind in SCALARS for kind in kinds_of(declaration).values())
