"""Decimation against brute force: for any rows, every bucket keeps its extremes."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from kernels.arrays import Array
from servo_ctrl.recording.min_max import bucket_rows, extremes, min_max, thinned

ROWS = hnp.arrays(
    np.float64,
    st.tuples(st.integers(0, 40), st.just(3)),
    elements=st.floats(-1e3, 1e3) | st.just(np.nan) | st.integers(-2, 2).map(float),
)


@settings(max_examples=150, deadline=None)
@given(ROWS, st.integers(1, 12), st.integers(0, 11), st.lists(st.integers(0, 2), min_size=1, max_size=3))
def test_every_bucket_keeps_its_least_and_its_greatest_value_in_the_order_they_came(
    rows: Array, bucket: int, lead: int, columns: list[int]
) -> None:
    lead %= bucket
    indices = np.array(columns, dtype=np.int64)
    found, where = min_max(rows, indices, bucket, lead), extremes(rows, indices, bucket, lead)
    values_of = [[math.nan] * lead + rows[:, column].tolist() for column in range(3)]
    assert found.shape == (len(columns), math.ceil((len(rows) + lead) / bucket), 2)
    for k, column in enumerate(columns):
        for place in range(found.shape[1]):
            values = values_of[column][place * bucket : (place + 1) * bucket]
            numbers = [value for value in values if not math.isnan(value)]
            if not numbers:
                assert np.isnan(found[k, place]).all()
                assert (where[k, place] == -1).all()
                continue
            assert sorted(found[k, place]) == [min(numbers), max(numbers)]
            first, second = where[k, place] + lead - place * bucket
            assert 0 <= first <= second < len(values)
            assert [values[first], values[second]] == found[k, place].tolist()


@settings(max_examples=150, deadline=None)
@given(ROWS, st.integers(1, 12))
def test_decimation_keeps_every_peak_and_every_gap(rows: Array, stretches: int) -> None:
    y = rows[:, 1]  # not contiguous
    x, short = thinned(np.arange(len(y), dtype=np.float64), y, stretches)
    if len(y) <= 2 * stretches:
        np.testing.assert_array_equal(short, y)
        return
    bucket = math.ceil(len(y) / stretches)
    expected: set[int] = set()
    for begin in range(0, len(y), bucket):
        part = y[begin : begin + bucket].tolist()
        numbers = [value for value in part if not math.isnan(value)]
        chosen = {part.index(min(numbers)), part.index(max(numbers))} if numbers else {0}
        expected |= {begin + place for place in chosen}
    assert x.tolist() == sorted(expected)
    np.testing.assert_array_equal(short, y[sorted(expected)])


def test_a_single_sample_in_a_minute_stays_visible() -> None:
    rows = np.zeros((60_000, 2))
    rows[34_567, 1] = 1e-6
    found = min_max(rows, np.array([0, 1]), bucket_rows(len(rows), 1000))
    assert found.shape[1] <= 1000
    assert found[1].max() == 1e-6
    assert found[0].max() == 0.0


@given(st.integers(1, 60_000), st.integers(2, 2000), st.integers(0, 10**9))
def test_a_span_makes_no_more_buckets_than_there_are_pixels_wherever_it_begins(
    span: int, width: int, first: int
) -> None:
    bucket = bucket_rows(span, width)
    assert (first + span - 1) // bucket - first // bucket + 1 <= width
