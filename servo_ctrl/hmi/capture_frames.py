"""What a chart is sent: the buckets that it has not got yet, computed once for all who look at the same."""

from __future__ import annotations

from collections import OrderedDict
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np

from servo_ctrl.hmi.contour_path import path_points
from servo_ctrl.telemetry.min_max import min_max

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

KEPT_PAYLOADS = 32
"""Of the newest; a full one of eight channels is some 140 kB."""


RowsFrom: TypeAlias = "Callable[[int, int], Array]"
"""Rows [begin, end) by their numbers."""


class Frame(NamedTuple):
    """Points for a chart that holds arrays of one length: drop, cut, then append."""

    drop: int
    """Points to drop at the front."""
    cut: int
    """Points to drop at the end."""
    points: int
    """Points of each array in the payload."""
    payload: bytes
    """float64 of this machine: the array of row numbers, then one for each channel."""
    reset: bool = False
    """Forget all points first."""


class View(NamedTuple):
    """Which points a chart holds; another view begins anew."""

    columns: tuple[int, ...]
    bucket: int
    picture: int
    """Row that the picture is about; -1 = it runs free."""
    factor: float = 0.0
    """0: channels over time. Else a path, its error so much magnified; columns: command, actual, x and y."""

    @property
    def per_bucket(self) -> int:
        """Points of a bucket: its extremes, or the one that is farthest off its path."""
        return 1 if self.bucket == 1 or self.factor else 2


class Held(NamedTuple):
    """What a chart has: buckets from the first on; the last one may be half full."""

    view: View
    first: int
    whole: int
    """Buckets before this one are whole."""
    points: int
    end: int
    """The row behind the last one."""


class Payloads:
    """The newest payloads, by what is in them. Row numbers never mean other rows, so none goes stale."""

    def __init__(self) -> None:
        self.made = self.shared = 0
        self._kept: OrderedDict[tuple[tuple[int, ...], int, float, int, int], bytes] = OrderedDict()

    def points(self, rows_from: RowsFrom, view: View, begin: int, end: int) -> bytes:
        """Points of the rows [begin, end)."""
        key = (view.columns, view.bucket, view.factor, begin, end)
        kept = self._kept.get(key)
        if kept is not None:
            self._kept.move_to_end(key)
            self.shared += 1
            return kept
        rows = rows_from(begin, end)
        if view.factor:
            kept = path_points(rows[:, view.columns], view.bucket, begin % view.bucket, view.factor)
        else:
            kept = points_of(rows, begin, view)
        self._kept[key] = kept
        if len(self._kept) > KEPT_PAYLOADS:
            self._kept.popitem(last=False)
        self.made += 1
        return kept


def points_of(rows: Array, begin: int, view: View) -> bytes:
    """Row numbers, then each column: all values, or the extremes of each bucket in the order they came."""
    columns = np.array(view.columns, dtype=np.int64)
    if view.bucket == 1:
        every = np.vstack((np.arange(begin, begin + len(rows), dtype=np.float64), rows[:, columns].T))
        return bytes(every.tobytes())
    found = min_max(rows, columns, view.bucket, begin % view.bucket)
    # the two points of a bucket are drawn at its quarters: they are where they are within half a bucket
    place = (begin // view.bucket + np.arange(found.shape[1])[:, np.newaxis]) * float(view.bucket)
    number = place + (view.bucket - 1) * np.array([0.25, 0.75])
    return bytes(np.concatenate((number[np.newaxis], found)).tobytes())


def next_frame(
    payloads: Payloads, rows_from: RowsFrom, view: View, span: tuple[int, int], held: Held | None
) -> tuple[Held, Frame | None]:
    """What brings a chart that has `held` to the rows `span` [begin, end); None: it has all of it."""
    bucket = view.bucket
    per_bucket = view.per_bucket
    first, end, whole = span[0] // bucket, -(-span[1] // bucket), span[1] // bucket
    points = (end - first) * per_bucket
    if held is not None and held.view == view and (first, span[1]) == (held.first, held.end):
        return held, None
    known = held is not None and held.view == view and held.first <= first <= held.whole <= whole
    if held is None or not known or span[1] <= held.whole * bucket:
        payload = payloads.points(rows_from, view, *span)
        return Held(view, first, whole, points, span[1]), Frame(0, 0, points, payload, reset=True)
    drop = (first - held.first) * per_bucket
    cut = held.points - (held.whole - held.first) * per_bucket
    begin = held.whole * bucket
    payload = payloads.points(rows_from, view, begin, span[1])
    return Held(view, first, whole, points, span[1]), Frame(
        drop, cut, (end - held.whole) * per_bucket, payload
    )
