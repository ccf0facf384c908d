"""The scope of one visitor without its elements: settings in; frames, rows and a state in words out."""

from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.hmi.charts.frames import ChartContents, ChartFrame, ChartView, PayloadCache, next_frame
from servo_ctrl.hmi.languages.texts import tr
from servo_ctrl.hmi.link.row_ring import RowRing
from servo_ctrl.hmi.scope.capture import CaptureSettings, CaptureState, CaptureWindow, advance
from servo_ctrl.hmi.scope.math_channels import MathChannel
from servo_ctrl.hmi.scope.trigger import Trigger, TriggerState, find_triggers
from servo_ctrl.hmi.shell.machine_stage import Tone
from servo_ctrl.recording.min_max import bucket_rows

WIDTHS = range(200, 2001, 200)
"""Chart widths for which rows are decimated, pixels; chosen: charts of similar width share their points."""
FREE_RUNNING = -1
"""Number of the window while the scope is free running."""


class CapturedRows(NamedTuple):
    """Consecutive rows (n, channels) and the number of the first."""

    first: int
    values: Array


class ScopeStream:
    """One open scope; `cache` is shared by all scopes of the process."""

    def __init__(self, cache: PayloadCache) -> None:
        self.settings = CaptureSettings(span=1000)
        self.trigger = Trigger()
        self.columns: tuple[int, ...] = ()
        self.width = WIDTHS[4]
        self.hold = False
        self.capture = CaptureState(0)
        self._shared, self._cache = cache, cache
        self._math: tuple[MathChannel, ...] = ()
        self._period_s = 1.0
        self._trigger_state = TriggerState()
        self._searched = -1
        """Rows before this one were searched for triggers."""
        self._contents: ChartContents | None = None
        self._stops: tuple[int, ...] = ()
        """Rows at which the machine stopped, since the last search."""
        self._kept: CapturedRows | None = None
        """The rows of a complete or held window, which the ring would overwrite."""

    @property
    def origin(self) -> int:
        """The row at which the time is zero."""
        return self.capture.window.origin if self.capture.window is not None else 0

    def arm(self, ring: RowRing) -> None:
        """Restart the capture: after a change of settings, and for the next single window."""
        self.capture, self._trigger_state = CaptureState(ring.end), TriggerState()
        self._searched, self._kept, self.hold = ring.end, None, False
        self._stops = ()

    def compute(self, math: Sequence[MathChannel], period_s: float) -> None:
        """Append these channels to the columns of every row from now on."""
        self._math, self._period_s = tuple(math), period_s
        # columns beyond those of the machine are others in another scope
        self._cache = PayloadCache() if self._math else self._shared
        self._kept, self._contents = None, None

    def resend(self) -> None:
        """Send all points with the next frame: the chart has lost its own."""
        self._contents = None

    def set_width(self, pixels: float) -> None:
        """Decimate for a chart of this width."""
        self.width = max((width for width in WIDTHS if width <= pixels), default=WIDTHS[0])

    def note_stop(self, ring: RowRing) -> None:
        """Note that the machine stops: the newest row triggers, whether or not a drive reports a fault."""
        if self.trigger.kind == "fault":
            # one in the very rows in which the scope was armed counts from the first row that does
            self._stops = (max(ring.end - 1, self.capture.armed_from, 0),)

    def state(self) -> tuple[str, Tone]:
        """Return the state of the capture in words, and its tone."""
        capture = self.capture
        if self.hold:
            return tr("held"), "warn"
        if self.settings.free:
            return tr("free running"), "calm"
        if capture.done or capture.filling:
            return tr("captured") if capture.done else tr("triggered"), "good"
        if capture.window is None:
            return tr("waiting for the trigger"), "calm"
        if capture.window.triggered:
            return tr("triggered, waiting for the next"), "good"
        return tr("no trigger: free running"), "calm"

    def toggle_hold(self, ring: RowRing) -> None:
        """Keep the window as it is, or go on."""
        self.hold = not self.hold
        if self.hold:
            self._keep(ring)
        else:
            self._kept, self._searched = None, ring.end
            if self.capture.done:
                self.arm(ring)

    def frame(self, ring: RowRing) -> ChartFrame | None:
        """Return the frame that brings the chart to the newest rows; None: it shows them already."""
        if not self.hold:
            self._advance(ring)
        window = self.capture.window
        if window is None or not self.columns:
            return None
        span = self._span(window, ring)
        if span[1] <= span[0]:
            return None
        bucket = bucket_rows(self.settings.span, self.width)
        view = ChartView(self.columns, bucket, window.origin if window.triggered else FREE_RUNNING)
        self._contents, frame = next_frame(
            self._cache, lambda begin, end: self._values(ring, begin, end), view, span, self._contents
        )
        return frame

    def rows(self, ring: RowRing) -> CapturedRows:
        """Return the rows that are shown, at full rate; perhaps none."""
        window = self.capture.window
        if window is None:
            return CapturedRows(ring.end, np.zeros((0, len(ring.names) + len(self._math))))
        first, end = self._span(window, ring)
        return CapturedRows(first, self._values(ring, first, max(end, first)))

    def _advance(self, ring: RowRing) -> None:
        before = self.capture
        triggers: list[int] = []
        if not self.settings.free and not before.done:
            first, rows = ring.since(max(self._searched, 0))
            self._trigger_state, places = find_triggers(self.trigger, self._trigger_state, rows)
            triggers = sorted({*(places + first).tolist(), *self._stops})
            self._stops = ()
        self._searched = ring.end
        self.capture = capture = advance(self.settings, before, triggers, ring.end)
        if capture.window != before.window or capture.filling != before.filling:
            self._kept = None
            if capture.window is not None and capture.window.triggered and not capture.filling:
                self._keep(ring)

    def _keep(self, ring: RowRing) -> None:
        if self._kept is None:
            self._kept = self.rows(ring)

    def _span(self, window: CaptureWindow, ring: RowRing) -> tuple[int, int]:
        """Return the rows [first, end) of a window that exist."""
        if self._kept is not None:
            return self._kept.first, self._kept.first + len(self._kept.values)
        return max(window.first, ring.first), min(window.last, ring.end)

    def _values(self, ring: RowRing, begin: int, end: int) -> Array:
        """Return the rows [begin, end); those that were overwritten are NaN."""
        if self._kept is None and self._math:
            return self._computed(ring, self._recorded(ring, begin - 1, end))
        return self._recorded(ring, begin, end)

    def _computed(self, ring: RowRing, rows: Array) -> Array:
        """Return the rows without the first, which precedes them, with the computed channels as columns."""
        places = {name: place for place, name in enumerate(ring.names)}
        columns = [channel.values(rows, places, self._period_s) for channel in self._math]
        return np.column_stack((rows[1:], *columns))

    def _recorded(self, ring: RowRing, begin: int, end: int) -> Array:
        first, rows = self._kept or ring.since(begin)
        values = rows[max(begin - first, 0) : max(end - first, 0)]
        if begin < first:
            gone = np.full((min(first, end) - begin, rows.shape[1]), np.nan)
            values = np.concatenate((gone, values))
        return values


def row_at(rows: CapturedRows, number: float) -> Array | None:
    """Return all channels at the row nearest to a (fractional) row number; None outside of the rows."""
    place = round(number) - rows.first
    return rows.values[place] if 0 <= place < len(rows.values) else None


def clock_text(status: MachineStatus | None, ring: RowRing, origin: int, period_s: float) -> str:
    """Return the local time at which the time axis is zero, by the newest status; "" without one.

    In lockstep cycles run by no clock: it is that of a machine which had kept its period since.
    """
    try:
        status_time = datetime.fromisoformat(status.time if status is not None else "")
    except ValueError:
        return ""
    if status is None or ring.end == ring.first:
        return ""
    at = min(max(origin, ring.first), ring.end - 1)
    _, rows = ring.since(at)
    since_s = (status.cycles - float(rows[0, ring.place("cycle")]) - (origin - at)) * period_s
    zero = (status_time - timedelta(seconds=since_s)).astimezone()
    return tr("time 0 is {clock}", clock=f"{zero:%H:%M:%S}.{zero.microsecond // 1000:03d}")


def missing_cycles(rows: CapturedRows, cycle: int) -> int:
    """Return the cycles without a row, by the column `cycle`: missed ticks, or rows that did not arrive."""
    counts = rows.values[:, cycle]
    return int(counts[-1] - counts[0]) + 1 - len(counts) if len(counts) else 0
