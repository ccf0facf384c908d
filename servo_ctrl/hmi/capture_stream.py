"""The scope of one visitor, without its looks: settings in, frames, readings and rows out."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from servo_ctrl.hmi.capture import Capture, Settings, advance, begin
from servo_ctrl.hmi.capture_frames import Held, Payloads, View, next_frame
from servo_ctrl.hmi.trigger import Trigger, Watch, fired
from servo_ctrl.telemetry.min_max import bucket_rows

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from servo_ctrl.hmi.capture import Picture
    from servo_ctrl.hmi.capture_frames import Frame
    from servo_ctrl.hmi.row_ring import RowRing

    Array = NDArray[np.float64]

WIDTHS = range(200, 2001, 200)
"""Pixels that are drawn for, so that windows of nearly one size share their points."""


class Rows(NamedTuple):
    """Consecutive rows (n, channels) and the number of the first."""

    first: int
    values: Array


class ScopeStream:
    """One open scope. `payloads` is shared by all of the process."""

    def __init__(self, payloads: Payloads) -> None:
        self.settings = Settings(span=1000)
        self.trigger = Trigger()
        self.columns: tuple[int, ...] = ()
        self.width = WIDTHS[4]
        self.hold = False
        self.capture = begin(0)
        self._payloads = payloads
        self._watch = Watch()
        self._looked = -1
        self._held: Held | None = None
        self._stopped: tuple[int, ...] = ()
        self._still: Rows | None = None
        """The rows of a picture that is complete: the ring goes on without it."""

    def arm(self, ring: RowRing) -> None:
        """Begin anew: after other settings, and for the next single picture."""
        self.capture, self._watch = begin(ring.end), Watch()
        self._looked, self._still, self.hold = ring.end, None, False

    def resend(self) -> None:
        """The chart has lost its points."""
        self._held = None

    def set_width(self, pixels: float) -> None:
        """The chart is so wide."""
        self.width = max((width for width in WIDTHS if width <= pixels), default=WIDTHS[0])

    def stop_seen(self, ring: RowRing) -> None:
        """The machine is stopping: with the fault trigger, the newest row is one, whatever the drives say."""
        if self.trigger.kind == "fault":
            self._stopped = (max(ring.end - 1, 0),)

    def state(self) -> tuple[str, str]:
        """In a word, and its tone."""
        capture = self.capture
        if self.hold:
            return "held", "warn"
        if self.settings.free:
            return "free running", "calm"
        if capture.done:
            return "taken", "good"
        if capture.filling:
            return "triggered", "good"
        if capture.shown is None:
            return "waiting for the trigger", "calm"
        shown = capture.shown.triggered
        return ("triggered, waiting for the next", "good") if shown else ("no trigger: free running", "calm")

    def toggle_hold(self, ring: RowRing) -> None:
        """Keep the picture as it is, or go on."""
        self.hold = not self.hold
        if self.hold:
            self._keep(ring)
        else:
            self._still, self._looked = None, ring.end
            if self.capture.done:
                self.arm(ring)

    def frame(self, ring: RowRing) -> Frame | None:
        """What the chart needs to show the newest rows; None: nothing new."""
        if not self.hold:
            self._advance(ring)
        picture = self.capture.shown
        if picture is None or not self.columns:
            return None
        span = self._span(picture, ring)
        if span[1] <= span[0]:
            return None
        bucket = bucket_rows(self.settings.span, self.width)
        view = View(self.columns, bucket, picture.origin if picture.triggered else -1)
        self._held, frame = next_frame(
            self._payloads, lambda begin, end: self._values(ring, begin, end), view, span, self._held
        )
        return frame

    def rows(self, ring: RowRing) -> Rows:
        """The rows that are seen, at full rate; perhaps none."""
        picture = self.capture.shown
        if picture is None:
            return Rows(ring.end, np.zeros((0, len(ring.names))))
        first, end = self._span(picture, ring)
        return Rows(first, self._values(ring, first, max(end, first)))

    def _advance(self, ring: RowRing) -> None:
        before = self.capture
        triggers: list[int] = []
        if not self.settings.free and not before.done:
            first, rows = ring.since(max(self._looked, 0))
            self._watch, places = fired(self.trigger, self._watch, rows)
            triggers = sorted({*(places + first).tolist(), *self._stopped})
            self._stopped = ()
        self._looked = ring.end
        self.capture = advance(self.settings, before, triggers, ring.end)
        if self.capture.shown != before.shown or self.capture.filling != before.filling:
            self._still = None
            if self._complete(self.capture):
                self._keep(ring)

    def _complete(self, capture: Capture) -> bool:
        return capture.shown is not None and capture.shown.triggered and not capture.filling

    def _keep(self, ring: RowRing) -> None:
        if self._still is None:
            self._still = self.rows(ring)

    def _span(self, picture: Picture, ring: RowRing) -> tuple[int, int]:
        """What there is of a picture: rows [first, end)."""
        if self._still is not None:
            return self._still.first, self._still.first + len(self._still.values)
        return max(picture.first, ring.first), min(picture.last, ring.end)

    def _values(self, ring: RowRing, begin: int, end: int) -> Array:
        """Rows [begin, end); those that are gone are missing values."""
        first, rows = self._still or ring.since(begin)
        values = rows[max(begin - first, 0) : max(end - first, 0)]
        if begin < first:
            gone = np.full((min(first, end) - begin, len(ring.names)), np.nan)
            values = np.concatenate((gone, values))
        return values


def reading(rows: Rows, number: float) -> Array | None:
    """All channels at the row nearest to a (fractional) number; None outside."""
    place = round(number) - rows.first
    return rows.values[place] if 0 <= place < len(rows.values) else None


def rows_missing(rows: Rows, cycle: int) -> int:
    """Cycles that have no row, by the column of the cycle: missed ticks, or rows that did not arrive."""
    counts = rows.values[:, cycle]
    return int(counts[-1] - counts[0]) + 1 - len(counts) if len(counts) else 0
