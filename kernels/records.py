"""Reading and writing the values of records, whose memory layout a NamedTuple declares (`record_layout`).

A kernel is a pure function of NamedTuples; values that persist between calls are in records, numpy's
structured arrays. One declaration gives both. `read` and `write` work equally in Python and in compiled
functions, where they become plain loads and stores: to pass one array from Python costs a tenth of passing a
nested tuple, and no code depends on positions in a tuple.
"""

from typing import Any, TypeVar

import numpy as np

from kernels.lean_import import as_if_absent
from kernels.record_layout import SCALARS, Place, Pool, Table, is_flat, kinds_of, numbers_of

with as_if_absent("scipy"):  # as in `jit`
    from numba import types
    from numba.core import cgutils
    from numba.extending import intrinsic, overload
    from numba.np.arrayobj import populate_array

T = TypeVar("T")
_COMPILED: dict[Any, Any] = {float: types.float64, int: types.int64, bool: types.boolean}
_TABLE = types.Array(types.float64, 2, "C")


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
        if kind in SCALARS:
            fields.append(number)
        elif kind == Table:
            start, rows, columns = number
            fields.append(pool[start : start + rows * columns].reshape(rows, columns))
        else:
            fields.append(_value(number, kind, pool))
    return declaration._make(fields)


def write(record: Any, value: tuple[Any, ...]) -> None:
    """Write a value without tables into a record, in place."""
    for name, number in zip(record.dtype.names, numbers_of(value, []), strict=True):
        record[name] = number


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
        _COMPILED[kind] if kind in _COMPILED else _TABLE if kind == Table else _compiled_type(kind)
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
        if kind in SCALARS:
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


def _store_fields(context: Any, builder: Any, record: Any, memory: Any, value: Any, fields: Any) -> None:
    """Generate code that stores a tuple of the type `value` into `record` at `memory`."""
    for index, (name, kind) in enumerate(kinds_of(value.instance_class).items()):
        inner, place = record.typeof(name), cgutils.pointer_add(builder, memory, record.offset(name))
        field = builder.extract_value(fields, index)
        if kind in SCALARS:
            pointer = builder.bitcast(place, context.get_data_type(inner).as_pointer())
            number = context.cast(builder, field, value.types[index], inner)
            context.pack_value(builder, inner, number, pointer)
        else:
            _store_fields(context, builder, inner, place, value.types[index], field)
