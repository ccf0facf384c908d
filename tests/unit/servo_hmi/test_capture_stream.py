"""A chart updated by frames equals the decimation of the whole picture, whichever frames were dropped."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kernels.arrays import Array
from servo_ctrl.hmi.charts.frames import ChartFrame, ChartView, PayloadCache, channel_points
from servo_ctrl.hmi.link.row_ring import RowRing
from servo_ctrl.hmi.scope.capture import CaptureSettings
from servo_ctrl.hmi.scope.stream import WIDTHS, ScopeStream, missing_cycles, row_at
from servo_ctrl.hmi.scope.trigger import Trigger
from servo_ctrl.recording.min_max import bucket_rows

NAMES = ("cycle", "x.position_command_m", "x.position_error_m")


class Chart:
    """What the browser does with frames: `points` is (arrays, n)."""

    def __init__(self, arrays: int) -> None:
        self.points = np.zeros((arrays, 0))

    def apply(self, frame: ChartFrame | None) -> None:
        if frame is None:
            return
        new = np.frombuffer(frame.payload).reshape(len(self.points), frame.points)
        kept = self.points[:, :0] if frame.reset else self.points
        kept = kept[:, frame.drop : kept.shape[1] - frame.cut]
        self.points = np.concatenate((kept, new), axis=1)


def made_up_rows(first: int, count: int) -> Array:
    """A triangle whose command turns every 400 rows, and an error that is different in every row."""
    number = np.arange(first, first + count, dtype=np.float64)
    triangle = 1e-3 * np.abs(number % 800 - 400)
    return np.column_stack((number, triangle, np.sin(1e3 * number)))


def opened(
    settings: CaptureSettings, trigger: Trigger | None = None, payloads: PayloadCache | None = None
) -> ScopeStream:
    stream = ScopeStream(payloads or PayloadCache())
    stream.settings, stream.trigger, stream.columns = settings, trigger or Trigger(), (1, 2)
    stream.set_width(250.0)
    return stream


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(0, 900), min_size=1, max_size=12), st.sampled_from([7, 150, 1000, 2777]))
def test_free_running_the_chart_holds_the_newest_rows_decimated(blocks: list[int], span: int) -> None:
    ring, stream, chart = RowRing(NAMES, 3000), opened(CaptureSettings(span=span)), Chart(3)
    for block in blocks:
        ring.extend(made_up_rows(ring.end, block))
        chart.apply(stream.frame(ring))
    bucket = bucket_rows(span, WIDTHS[0])
    begin = (
        max(ring.end - span, 0) // bucket * bucket
    )  # the first bucket is there whole where it was seen whole
    expected = channel_points(made_up_rows(begin, ring.end - begin), begin, ChartView((1, 2), bucket, -1))
    wanted = np.frombuffer(expected).reshape(3, -1)
    assert chart.points.shape == wanted.shape
    tail = slice(2 if bucket > 1 else 0, None)
    np.testing.assert_array_equal(chart.points[:, tail], wanted[:, tail])
    assert chart.points.shape[1] <= 2 * WIDTHS[0]


@settings(max_examples=40, deadline=None)
@given(st.lists(st.integers(1, 500), min_size=4, max_size=12))
def test_a_triggered_window_is_kept_after_the_ring_has_overwritten_it(blocks: list[int]) -> None:
    chosen = CaptureSettings(span=300, before=100, mode="single", free=False)
    ring, stream, chart = RowRing(NAMES, 1200), opened(chosen, Trigger("reversal", (1,))), Chart(3)
    for block in [*blocks, *[90] * 20]:
        ring.extend(made_up_rows(ring.end, block))
        chart.apply(stream.frame(ring))
    seen = stream.rows(ring)
    assert stream.capture.done
    assert stream.capture.window is not None
    assert stream.capture.window.origin in {401, 801}  # the first row of the new direction
    assert seen.first == stream.capture.window.first
    np.testing.assert_array_equal(seen.values, made_up_rows(seen.first, 300))
    assert chart.points[2].max() == seen.values[:, 2].max()
    assert chart.points[2].min() == seen.values[:, 2].min()


def test_a_held_window_stays_and_sends_nothing() -> None:
    ring, stream = RowRing(NAMES, 500), opened(CaptureSettings(span=100))
    ring.extend(made_up_rows(0, 200))
    assert stream.frame(ring) is not None
    stream.toggle_hold(ring)
    ring.extend(made_up_rows(200, 5000))
    assert stream.frame(ring) is None
    np.testing.assert_array_equal(stream.rows(ring).values, made_up_rows(100, 100))
    stream.columns = (2,)  # another channel of the same picture
    frame = stream.frame(ring)
    assert frame is not None
    np.testing.assert_array_equal(np.frombuffer(frame.payload)[100:], made_up_rows(100, 100)[:, 2])
    stream.toggle_hold(ring)
    stream.frame(ring)
    assert stream.rows(ring).first == 5100


def test_charts_of_the_same_view_share_their_points() -> None:
    ring, payloads = RowRing(NAMES, 3000), PayloadCache()
    streams = [opened(CaptureSettings(span=2000), payloads=payloads) for _ in range(10)]
    for _ in range(50):
        ring.extend(made_up_rows(ring.end, 33))
        frames = [stream.frame(ring) for stream in streams]
        assert all(frame is not None and frame.payload is frames[0].payload for frame in frames)


def test_a_frame_of_new_rows_is_small_however_long_the_window_is() -> None:
    ring, stream = RowRing(NAMES, 60_000), opened(CaptureSettings(span=60_000))
    ring.extend(made_up_rows(0, 60_000))
    whole = stream.frame(ring)
    ring.extend(made_up_rows(60_000, 33))
    tail = stream.frame(ring)
    assert whole is not None
    assert tail is not None
    assert len(whole.payload) <= 3 * 2 * WIDTHS[0] * 8
    assert len(tail.payload) <= 3 * 2 * 2 * 8


def test_a_cursor_reads_the_nearest_row_at_full_rate() -> None:
    ring, stream = RowRing(NAMES, 500), opened(CaptureSettings(span=300))
    ring.extend(made_up_rows(0, 400))
    stream.frame(ring)
    rows = stream.rows(ring)
    read = row_at(rows, 250.4)
    assert read is not None
    assert read[0] == 250.0
    assert row_at(rows, 99.0) is None
    assert row_at(rows, 400.0) is None


@pytest.mark.parametrize(("cycles", "missing"), [([5, 6, 7], 0), ([5, 8, 9], 2), ([], 0)])
def test_missing_cycles_are_counted(cycles: list[int], missing: int) -> None:
    ring, stream = RowRing(NAMES, 50), opened(CaptureSettings(span=10))
    rows = made_up_rows(0, len(cycles))
    rows[:, 0] = cycles
    ring.extend(rows)
    stream.frame(ring)
    assert missing_cycles(stream.rows(ring), 0) == missing


def test_a_stop_in_the_very_rows_in_which_the_scope_is_armed_triggers() -> None:
    ring = RowRing(NAMES, 3000)
    stream = opened(CaptureSettings(span=100, before=25, mode="single", free=False), Trigger("fault"))
    ring.extend(made_up_rows(0, 500))
    stream.arm(ring)
    stream.note_stop(ring)  # no row has come since
    ring.extend(made_up_rows(ring.end, 200))
    stream.frame(ring)
    assert stream.capture.done
    assert stream.origin == 500


def test_a_stop_before_the_scope_was_armed_does_not_trigger() -> None:
    ring = RowRing(NAMES, 3000)
    stream = opened(CaptureSettings(span=100, mode="normal", free=False), Trigger("fault"))
    ring.extend(made_up_rows(0, 500))
    stream.note_stop(ring)
    stream.arm(ring)
    ring.extend(made_up_rows(ring.end, 200))
    stream.frame(ring)
    assert stream.capture.window is None
