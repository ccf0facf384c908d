"""Frames for live charts: the buckets that a chart lacks, computed once for all charts of one view."""

from collections import OrderedDict
from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np

from kernels.arrays import Array
from servo_ctrl.hmi.charts.path_points import path_points
from servo_ctrl.recording.min_max import min_max

MAX_PAYLOADS = 32
"""Bounds the memory of the cache; a full payload of eight channels has some 140 kB."""

RowsBetween: TypeAlias = "Callable[[int, int], Array]"
"""Returns the rows [begin, end) by their numbers."""


class ChartFrame(NamedTuple):
    """A change of a chart that holds arrays of one length: drop, cut, then append."""

    drop: int
    """Points to remove at the front."""
    cut: int
    """Points to remove at the end."""
    points: int
    """Points of each array in the payload."""
    payload: bytes
    """float64 in the byte order of this computer: the array of row numbers, then one for each channel."""
    reset: bool = False
    """Remove all points first."""


class ChartView(NamedTuple):
    """Which points a chart holds; a chart with another view starts anew."""

    columns: tuple[int, ...]
    bucket: int
    """Rows in a bucket."""
    trigger_row: int
    """Row that the picture is triggered by; -1: it runs free."""
    factor: float = 0.0
    """Magnification of the error of a path, with the columns command and actual, x and y; 0: no path."""

    @property
    def points_per_bucket(self) -> int:
        """The minimum and maximum of each channel, or the row of a path with the largest error."""
        return 1 if self.bucket == 1 or self.factor else 2


class ChartContents(NamedTuple):
    """What a chart holds: whole buckets from `first` on, and perhaps a last one in part."""

    view: ChartView
    first: int
    whole: int
    """The buckets before this one are whole."""
    points: int
    end: int
    """The row after the last one."""


class PayloadCache:
    """The newest payloads by their contents. A row number never gets other contents, so none goes stale."""

    def __init__(self) -> None:
        self.made = self.shared = 0
        self._payloads: OrderedDict[tuple[tuple[int, ...], int, float, int, int], bytes] = OrderedDict()

    def points(self, rows_between: RowsBetween, view: ChartView, begin: int, end: int) -> bytes:
        """The points of the rows [begin, end)."""
        key = (view.columns, view.bucket, view.factor, begin, end)
        payload = self._payloads.get(key)
        if payload is not None:
            self._payloads.move_to_end(key)
            self.shared += 1
            return payload
        rows = rows_between(begin, end)
        if view.factor:
            payload = path_points(rows[:, view.columns], view.bucket, begin % view.bucket, view.factor)
        else:
            payload = channel_points(rows, begin, view)
        self._payloads[key] = payload
        if len(self._payloads) > MAX_PAYLOADS:
            self._payloads.popitem(last=False)
        self.made += 1
        return payload


def bucket_places(buckets: int, bucket: int) -> Array:
    """Row offsets (buckets, 2) at which the two extremes of each bucket are drawn: its quarters.

    So each is within half a bucket of its true row.
    """
    first = np.arange(buckets, dtype=np.float64)[:, np.newaxis] * bucket
    return np.asarray(first + (bucket - 1) * np.array([0.25, 0.75]))


def channel_points(rows: Array, begin: int, view: ChartView) -> bytes:
    """Row numbers, then each channel: all values, or the two extremes of each bucket in order of time."""
    columns = np.array(view.columns, dtype=np.int64)
    if view.bucket == 1:
        every = np.vstack((np.arange(begin, begin + len(rows), dtype=np.float64), rows[:, columns].T))
        return bytes(every.tobytes())
    extremes = min_max(rows, columns, view.bucket, begin % view.bucket)
    first = float(begin // view.bucket * view.bucket)
    number = first + bucket_places(extremes.shape[1], view.bucket)
    return bytes(np.concatenate((number[np.newaxis], extremes)).tobytes())


def next_frame(
    cache: PayloadCache,
    rows_between: RowsBetween,
    view: ChartView,
    span: tuple[int, int],
    contents: ChartContents | None,
) -> tuple[ChartContents, ChartFrame | None]:
    """Return the frame that brings a chart to the rows `span` [begin, end), and its contents then.

    The frame is None when the chart has all of them already.
    """
    bucket, per_bucket = view.bucket, view.points_per_bucket
    first, end, whole = span[0] // bucket, -(-span[1] // bucket), span[1] // bucket
    following = ChartContents(view, first, whole, (end - first) * per_bucket, span[1])
    if contents is None or contents.view != view:
        return following, _whole_frame(cache, rows_between, following, span)
    if (first, span[1]) == (contents.first, contents.end):
        return contents, None
    overlaps = contents.first <= first <= contents.whole <= whole
    if not overlaps or span[1] <= contents.whole * bucket:
        return following, _whole_frame(cache, rows_between, following, span)
    payload = cache.points(rows_between, view, contents.whole * bucket, span[1])
    frame = ChartFrame(
        drop=(first - contents.first) * per_bucket,
        cut=contents.points - (contents.whole - contents.first) * per_bucket,
        points=(end - contents.whole) * per_bucket,
        payload=payload,
    )
    return following, frame


def _whole_frame(
    cache: PayloadCache, rows_between: RowsBetween, contents: ChartContents, span: tuple[int, int]
) -> ChartFrame:
    payload = cache.points(rows_between, contents.view, *span)
    return ChartFrame(0, 0, contents.points, payload, reset=True)
