"""Values are written into a record and read back unchanged, in Python and compiled, by name."""

import math
from typing import Any, NamedTuple

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from kernels.record_layout import Pool, Table, record_type, store
from kernels.records import read, write


class Inner(NamedTuple):
    switch: bool
    count: int
    size_m: float


class Curve(NamedTuple):
    gain: float
    nodes: Table


class Part(NamedTuple):
    inner: Inner
    curve: Curve
    other: Table
    last: bool


class Pair(NamedTuple):
    left_m: float
    right_m: float


class Moved(NamedTuple):
    pair: Pair
    inner: Inner


class Text(NamedTuple):
    name: str


NUMBER = st.floats(allow_nan=False)
TABLES = arrays.arrays(
    np.float64, st.tuples(st.integers(1, 3), st.integers(1, 4)), elements=st.floats(-1e6, 1e6)
)
INNERS = st.builds(Inner, st.booleans(), st.integers(-(2**62), 2**62), NUMBER)
PARTS = st.builds(Part, INNERS, st.builds(Curve, NUMBER, TABLES), TABLES, st.booleans())


@numba.njit
def summed(records: Any, pool: Pool) -> tuple[Any, float]:
    """The last part as the compiler reads it, and something of every table of all."""
    total = 0.0
    part = read(records[0], Part, pool)
    for record in records:
        part = read(record, Part, pool)
        total += part.curve.nodes[-1, -1] + part.other[0, -1]
    return (part.inner, part.curve.gain, part.last), total


@numba.njit
def copied(target: Any, source: Any) -> None:
    for index in range(len(source)):
        value = read(source[index], Moved)
        write(target[index], Moved(pair=Pair(value.pair.right_m, value.pair.left_m), inner=value.inner))


@settings(deadline=None)  # the first has to compile
@given(st.lists(PARTS, min_size=1, max_size=3))
def test_what_is_stored_is_read(parts: list[Part]) -> None:
    records = np.zeros(len(parts), record_type(Part))
    pool = store(records, parts)
    for record, part in zip(records, parts, strict=True):
        assert repr(read(record, Part, pool)) == repr(part)
    (inner, gain, last), total = summed(records, pool)
    assert repr((Inner(*inner), gain, last)) == repr((parts[-1].inner, parts[-1].curve.gain, parts[-1].last))
    assert total == sum(part.curve.nodes[-1, -1] + part.other[0, -1] for part in parts)


@settings(deadline=None)  # the first has to compile
@given(NUMBER, NUMBER, INNERS)
def test_what_is_written_is_read(left_m: float, right_m: float, inner: Inner) -> None:
    source, target = np.zeros(2, record_type(Moved)), np.zeros(2, record_type(Moved))
    write(source[1], Moved(Pair(left_m, right_m), inner))
    copied(target, source)
    assert repr(read(target[1], Moved)) == repr(Moved(Pair(right_m, left_m), inner))
    assert read(target[0], Moved) == Moved(Pair(0.0, 0.0), Inner(False, 0, 0.0))


def test_fields_are_there_by_name_and_keep_their_types() -> None:
    records = np.zeros(1, record_type(Moved))
    write(records[0], Moved(pair=Pair(left_m=1.0, right_m=-0.0), inner=Inner(True, 7, math.nan)))
    assert math.copysign(1.0, records["pair"]["right_m"][0]) == -1.0
    records["pair"]["left_m"] = math.nan
    value = read(records[0], Moved)
    assert [type(field) for field in value.inner] == [bool, int, float]
    assert math.isnan(value.pair.left_m)


def test_a_layout_is_aligned_as_c_would() -> None:
    layout = record_type(Moved)
    assert layout.isalignedstruct
    assert layout.fields is not None
    assert [layout.fields[name][1] for name in ("pair", "inner")] == [0, 16]
    assert layout.itemsize == 40


def test_what_is_no_number_is_refused() -> None:
    with pytest.raises(TypeError, match=r"Text\.name: a record cannot hold"):
        record_type(Text)
