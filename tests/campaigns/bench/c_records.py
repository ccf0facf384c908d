"""The simulator's and the controller's records as C declarations, so that C reads the very same memory.

A numpy record that is C-aligned has the layout of the struct with the same members in the same order; a
`Params` tuple of the controller becomes such a record first, in which an array is its address and its number
of columns. Nothing is typed in twice.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

ARRAY = np.dtype([("address", np.int64), ("columns", np.int64)], align=True)
C_NAMES = {np.dtype(np.float64): "double", np.dtype(np.int64): "int64_t"}


def record_of(values: Any) -> Any:
    """A (nested) named tuple of numbers as a C-aligned record; integers and flags are int64.

    Arrays stay where they are: the caller keeps `values` alive.
    """
    record = np.zeros(1, _dtype_of(values))
    record[0] = _plain(values)
    return record[0]


def declarations(structs: Mapping[str, np.dtype[Any]]) -> str:
    """A header with one typedef per name.

    Raises:
        TypeError: a member that is neither a float64 nor an int64, an array of them, nor a record.

    """
    lines = ["#pragma once", "#include <stdint.h>"]
    lines += [f"typedef {_struct(dtype)} {name};" for name, dtype in structs.items()]
    # the compiler itself confirms the layout
    lines += [
        f'_Static_assert(sizeof({name}) == {dtype.itemsize}, "{name}");' for name, dtype in structs.items()
    ]
    return "\n".join(lines) + "\n"


def _struct(dtype: np.dtype[Any]) -> str:
    return "struct { " + " ".join(_member(name, dtype[name]) for name in dtype.names or ()) + " }"


def _member(name: str, dtype: np.dtype[Any]) -> str:
    if dtype.names:
        return f"{_struct(dtype)} {name};"
    base, shape = dtype.subdtype or (dtype, ())
    if base not in C_NAMES:
        raise TypeError(f"{name}: no C type for {base}")
    return f"{C_NAMES[base]} {name}{''.join(f'[{length}]' for length in shape)};"


def _dtype_of(value: Any) -> np.dtype[Any]:
    if isinstance(value, tuple):
        fields = value._asdict().items()  # type: ignore[attr-defined]  # a named tuple
        return np.dtype([(name, _dtype_of(member)) for name, member in fields], align=True)
    if isinstance(value, np.ndarray):
        return ARRAY
    return np.dtype(np.float64 if isinstance(value, float) else np.int64)


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        if value.dtype != np.float64 or not value.flags.c_contiguous:
            raise TypeError("only C-contiguous arrays of float64 can be read in C")
        return value.ctypes.data, value.shape[-1]
    return tuple(_plain(member) for member in value) if isinstance(value, tuple) else value
