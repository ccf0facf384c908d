"""The newest rows, as the page keeps them."""

import numpy as np
import pytest

from servo_ctrl.hmi.link.row_ring import RowRing


def rows(first: int, count: int) -> np.ndarray:
    numbers = np.arange(first, first + count, dtype=float)
    return np.column_stack((numbers, -numbers))


def test_the_newest_rows_are_kept_whatever_the_blocks_are() -> None:
    ring, random, sent = RowRing(("a", "b"), 50), np.random.default_rng(1), 0
    for size in random.integers(0, 120, 300):
        ring.extend(rows(sent, int(size)))
        sent += int(size)
        first, values = ring.since(0)
        assert (first, ring.end, len(ring)) == (max(sent - 50, 0), sent, min(sent, 50))
        np.testing.assert_array_equal(values, rows(first, sent - first))


def test_since_returns_the_new_rows_and_none_twice() -> None:
    ring = RowRing(("a", "b"), 50)
    ring.extend(rows(0, 30))
    assert ring.since(20)[0] == 20
    assert len(ring.since(30)[1]) == 0
    assert ring.since(99) == (30, pytest.approx(np.empty((0, 2))))
    np.testing.assert_array_equal(ring.column("b", since=28), [-28.0, -29.0])
    with pytest.raises(KeyError):
        ring.column("c")


def test_returned_arrays_are_copies() -> None:
    ring = RowRing(("a", "b"), 10)
    ring.extend(rows(0, 10))
    _, values = ring.since(0)
    column = ring.column("a")
    ring.extend(rows(10, 200))
    np.testing.assert_array_equal(values, rows(0, 10))
    np.testing.assert_array_equal(column, np.arange(10.0))
