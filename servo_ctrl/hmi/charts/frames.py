"""Frames for live charts: the buckets that a chart lacks, computed once for all charts of one view."""

from collections import OrderedDict
from collections.abc import Callable
from functools import cache
from typing import NamedTuple, TypeAlias

import numpy as np

from kernels.arrays import Array
from servo_ctrl.hmi.link.machine_link import MachineLink
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
    """Which points a chart holds; a chart with another view starts again."""

    columns: tuple[int, ...]
    bucket: int
    """Rows in a bucket."""
    trigger_row: int
    """Row that the picture is triggered by; -1: it runs free."""
    factor: float = 0.0
    """Magnification of the error of a path, with the columns command and actual, x and y; 0: no path."""


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
        self._payloads: OrderedDict[tuple[tuple[int, ...], int, float, int, int], bytes] = OrderedDict()

    def points(self, rows_between: RowsBetween, view: ChartView, begin: int, end: int) -> bytes:
        """Return the points of the rows [begin, end)."""
        key = (view.columns, view.bucket, view.factor, begin, end)
        payload = self._payloads.get(key)
        if payload is not None:
            self._payloads.move_to_end(key)
            return payload
        rows = rows_between(begin, end)
        if view.factor:
            payload = path_points(rows[:, view.columns], view.bucket, begin % view.bucket, view.factor)
        else:
            payload = channel_points(rows, begin, view)
        self._payloads[key] = payload
        if len(self._payloads) > MAX_PAYLOADS:
            self._payloads.popitem(last=False)
        return payload


@cache
def payloads_of(_link: MachineLink) -> PayloadCache:
    """Return the one cache for the rows of a link."""
    return PayloadCache()


def bucket_places(buckets: int, bucket: int) -> Array:
    """Return row offsets (buckets, 2) at which a bucket's two extremes are drawn: its quarters.

    So each is within half a bucket of its true row.
    """
    first = np.arange(buckets, dtype=np.float64)[:, np.newaxis] * bucket
    return np.asarray(first + (bucket - 1) * np.array([0.25, 0.75]))


def channel_points(rows: Array, begin: int, view: ChartView) -> bytes:
    """Return row numbers, then each channel: all values, or a bucket's two extremes in order of time."""
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
    bucket = view.bucket
    # the minimum and maximum of each channel, or the row of a path with the largest error
    per_bucket = 1 if bucket == 1 or view.factor else 2
    first, end, whole = span[0] // bucket, -(-span[1] // bucket), span[1] // bucket
    following = ChartContents(view, first, whole, (end - first) * per_bucket, span[1])
    if contents is not None and contents.view == view:
        if (first, span[1]) == (contents.first, contents.end):
            return contents, None
        overlaps = contents.first <= first <= contents.whole <= whole
        if overlaps and span[1] > contents.whole * bucket:
            return following, ChartFrame(
                drop=(first - contents.first) * per_bucket,
                cut=contents.points - (contents.whole - contents.first) * per_bucket,
                points=(end - contents.whole) * per_bucket,
                payload=cache.points(rows_between, view, contents.whole * bucket, span[1]),
            )
    payload = cache.points(rows_between, view, *span)
    return following, ChartFrame(0, 0, following.points, payload, reset=True)


def normal_error(command_m: Array, actual_m: Array) -> Array:
    """Return the part of the error (n, 2) that is normal to the direction of the command (n, 2).

    While the command rests, its last direction counts; before its first motion the whole error is returned.
    """
    error_m = actual_m - command_m
    step_m = np.diff(command_m, axis=0, prepend=command_m[:1])
    length_m = np.hypot(step_m[:, 0], step_m[:, 1])
    last_moving = np.maximum.accumulate(np.where(length_m > 0.0, np.arange(len(length_m)), -1))
    has_moved = last_moving >= 0
    tangent = np.zeros_like(step_m)
    tangent[has_moved] = step_m[last_moving[has_moved]] / length_m[last_moving[has_moved], np.newaxis]
    tangential_m = np.sum(error_m * tangent, axis=1)[:, np.newaxis]
    return np.asarray(error_m - tangential_m * tangent)


def path_points(rows: Array, bucket: int, lead: int, factor: float) -> bytes:
    """Return one point of each bucket of rows: the row with the largest normal error.

    `rows` (n, 4): command x and y, actual x and y; the first bucket lacks `lead` rows. The bytes are float64:
    command x, command y, then x and y of command + `factor` times the normal error.
    """
    if not len(rows):
        return b""
    command_m, actual_m = rows[:, :2], rows[:, 2:]
    error_m = normal_error(command_m, actual_m)
    size_m = np.nan_to_num(np.hypot(error_m[:, 0], error_m[:, 1]), nan=-1.0)
    begins = np.maximum(np.arange(-lead, len(rows), bucket), 0)
    largest = np.repeat(np.maximum.reduceat(size_m, begins), np.diff(begins, append=len(rows)))
    # where several rows of a bucket have its largest error, the first of them
    candidates = np.flatnonzero(size_m == largest)
    chosen = candidates[np.searchsorted(candidates, begins)]
    drawn_m = command_m[chosen] + factor * error_m[chosen]
    return bytes(np.vstack((command_m[chosen].T, drawn_m.T)).tobytes())
