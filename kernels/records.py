"""Records: the memory layout that a NamedTuple declares, and the reading and writing of its values.

A kernel is a pure function of NamedTuples; values that persist between calls are in records, numpy's
structured arrays. One declaration gives both. `read` and `write` work equally in Python and in compiled
functions, where they become plain loads and stores: to pass one array from Python costs a tenth of passing a
nested tuple, and no code depends on positions in a tuple.

A field is a `float`, `int` or `bool`, another NamedTuple, or a `Table`. Tables have no fixed size: their
numbers are in one pool beside the records, and a record holds the place in the pool.
"""

import struct
from collections.abc import Iterator, Sequence
from functools import cache
from typing import Any, NamedTuple, TypeVar, get_type_hints

import numpy as np
from numpy.typing import NDArray

from kernels.lean_import import as_if_absent

with as_if_absent("scipy"):  # as in `jit`
    from numba import types
    from numba.core import cgutils
    from numba.extending import intrinsic, overload
    from numba.np.arrayobj import populate_array

T = TypeVar("T")
Table = NDArray[np.float64]
"""(rows, columns), C-contiguous."""
Pool = NDArray[np.float64]
"""(n,): the numbers of all tables of several records."""


class Place(NamedTuple):
    """The place of a table in the pool."""

    start: int
    rows: int
    columns: int


_SCALARS: dict[Any, tuple[Any, Any]] = {
    float: (np.float64, types.float64),
    int: (np.int64, types.int64),
    bool: (np.bool_, types.boolean),
}
_TABLE = types.Array(types.float64, 2, "C")


@cache
def kinds_of(declaration: Any) -> dict[str, Any]:
    """Return the type of each field in order: `float`, `int`, `bool`, `Table` or another declaration.

    Raises:
        TypeError: a field is none of these.

    """
    fields = get_type_hints(declaration)
    for name, kind in fields.items():
        if kind not in _SCALARS and kind != Table and not _is_declaration(kind):
            raise TypeError(f"{declaration.__qualname__}.{name}: a record cannot hold {kind}")
    return fields


def _is_declaration(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, tuple) and hasattr(kind, "_fields")


@cache
def record_type(declaration: Any) -> np.dtype[Any]:
    """Return the C-aligned layout of a declaration, with the same field names."""
    layout: list[tuple[str, Any]] = []
    for name, kind in kinds_of(declaration).items():
        if kind in _SCALARS:
            layout.append((name, _SCALARS[kind][0]))
        else:
            layout.append((name, record_type(Place if kind == Table else kind)))
    return np.dtype(layout, align=True)


def store(records: NDArray[Any], values: Sequence[tuple[Any, ...]]) -> Pool:
    """Write one value into each of the records (n,); return the pool of their tables."""
    tables: list[Table] = []
    for index, value in enumerate(values):
        records[index] = _numbers(value, tables)
    return np.concatenate([np.zeros(0), *(table.ravel() for table in tables)])


def _numbers(value: Any, tables: list[Table]) -> tuple[Any, ...]:
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
            numbers.append(field if kind in _SCALARS else _numbers(field, tables))
    return tuple(numbers)


def read(record: Any, declaration: type[T], pool: Pool | None = None) -> T:
    """Return the value in a record, or in an array of one; its tables are views of the pool."""
    value: T = _value(record.item(), declaration, pool)
    return value


def _value(numbers: Any, declaration: Any, pool: Any) -> Any:
    """Return the value of a record's numbers, given as nested tuples."""
    if is_flat(declaration):
        return declaration._make(numbers)
    fields = []
    for kind, number in zip(kinds_of(declaration).values(), numbers, strict=True):
        if kind in _SCALARS:
            fields.append(number)
        elif kind == Table:
            start, rows, columns = number
            fields.append(pool[start : start + rows * columns].reshape(rows, columns))
        else:
            fields.append(_value(number, kind, pool))
    return declaration._make(fields)


@cache
def is_flat(declaration: Any) -> bool:
    """Whether a declaration has only numbers, so that numpy reads and writes its values directly."""
    return all(kind in _SCALARS for kind in kinds_of(declaration).values())


def write(record: Any, value: tuple[Any, ...]) -> None:
    """Write a value without tables into a record, in place."""
    for name, number in zip(record.dtype.names, _numbers(value, []), strict=True):
        record[name] = number


def flat_layout(record: np.dtype[Any], fields: Sequence[str]) -> tuple[struct.Struct, int]:
    """Return how to pack and unpack adjacent fields as flat numbers, and their offset, bytes.

    This is faster than numpy, which traverses a nested field at each call.

    Raises:
        ValueError: another field is between the fields, or they are in another order.

    """
    names = record.names or ()
    first = names.index(fields[0])
    if names[first : first + len(fields)] != tuple(fields):
        raise ValueError(f"{', '.join(fields)} are not adjacent")
    begin: int = next(offset for _code, offset, _size in _leaves(record[[fields[0]]], 0))
    codes, end = [], begin
    for code, offset, size in _leaves(record[list(fields)], 0):
        codes.append(f"{offset - end}x{code}" if offset > end else code)
        end = offset + size
    return struct.Struct("@" + "".join(codes)), begin


def _leaves(record: np.dtype[Any], offset: int) -> Iterator[tuple[str, int, int]]:
    """Yield the `struct` character, offset and size in bytes of each number in a record."""
    places: Any = record.fields
    for name in record.names or ():
        field, at = places[name][:2]
        if field.names:
            yield from _leaves(field, offset + at)
        else:
            yield field.char, offset + at, field.itemsize


@overload(read)
def _overload_read(record: Any, declaration: Any, pool: Any = None) -> Any:  # noqa: ARG001  # typed by name
    def compiled(record: Any, declaration: Any, pool: Any = None) -> Any:
        return _load(record, declaration, pool)

    return compiled


@overload(write)
def _overload_write(record: Any, value: Any) -> Any:  # noqa: ARG001  # the same
    def compiled(record: Any, value: Any) -> None:
        _store(record, value)

    return compiled


def _compiled_type(declaration: Any) -> Any:
    """Return numba's type of a value, equal to that of a value from Python."""
    kinds = kinds_of(declaration).values()
    fields = [
        _SCALARS[kind][1] if kind in _SCALARS else _TABLE if kind == Table else _compiled_type(kind)
        for kind in kinds
    ]
    if len(set(fields)) == 1:
        return types.NamedUniTuple(fields[0], len(fields), declaration)
    return types.NamedTuple(fields, declaration)


def _typed_load(_context: Any, record: Any, declaration: Any, pool: Any) -> Any:
    wanted = declaration.instance_class

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        memory, _, numbers = arguments
        if isinstance(signature.args[2], types.Array):
            numbers = context.make_array(signature.args[2])(context, builder, numbers).data
        return _load_fields(context, builder, record, memory, wanted, numbers)

    return _compiled_type(wanted)(record, declaration, pool), generate


_load: Any = intrinsic(_typed_load)


def _load_fields(context: Any, builder: Any, record: Any, memory: Any, declaration: Any, pool: Any) -> Any:
    """Generate code that loads the fields of `record` at `memory` as a tuple."""
    values = []
    for name, kind in kinds_of(declaration).items():
        inner, place = record.typeof(name), cgutils.pointer_add(builder, memory, record.offset(name))
        if kind in _SCALARS:
            pointer = builder.bitcast(place, context.get_data_type(inner).as_pointer())
            values.append(context.unpack_value(builder, inner, pointer))
        elif kind == Table:
            at = _load_fields(context, builder, inner, place, Place, pool)
            values.append(_view(context, builder, at, pool))
        else:
            values.append(_load_fields(context, builder, inner, place, kind, pool))
    return context.make_tuple(builder, _compiled_type(declaration), values)


def _view(context: Any, builder: Any, place: Any, pool: Any) -> Any:
    """Generate code for a view of the table at a `Place` of the pool, which the caller keeps alive."""
    start, rows, columns = (builder.extract_value(place, index) for index in range(3))
    size = context.get_constant(types.intp, np.dtype(np.float64).itemsize)
    table = context.make_array(_TABLE)(context, builder)
    strides = [builder.mul(columns, size), size]
    populate_array(table, builder.gep(pool, [start]), [rows, columns], strides, size, meminfo=None)
    return table._getvalue()  # noqa: SLF001  # numba's own name for a struct's value


def _typed_store(_context: Any, record: Any, value: Any) -> Any:
    def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        _store_fields(context, builder, record, arguments[0], value, arguments[1])
        return context.get_dummy_value()

    return types.void(record, value), generate


_store: Any = intrinsic(_typed_store)


def _store_fields(context: Any, builder: Any, record: Any, memory: Any, value: Any, held: Any) -> None:
    """Generate code that stores a tuple of the type `value` into `record` at `memory`."""
    for index, (name, kind) in enumerate(kinds_of(value.instance_class).items()):
        inner, place = record.typeof(name), cgutils.pointer_add(builder, memory, record.offset(name))
        field = builder.extract_value(held, index)
        if kind in _SCALARS:
            pointer = builder.bitcast(place, context.get_data_type(inner).as_pointer())
            number = context.cast(builder, field, value.types[index], inner)
            context.pack_value(builder, inner, number, pointer)
        else:
            _store_fields(context, builder, inner, place, value.types[index], field)
