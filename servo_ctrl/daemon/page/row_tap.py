"""Collects rows and cycle times for the page; a tick does no other work for the page."""

import time
from bisect import bisect_right
from collections.abc import Callable

from servo_ctrl.telemetry.local_socket.rows import RowBuffer

CYCLE_EDGES = (
    *(0.25, 0.5, 0.7, 0.8, 0.9, 0.95, 0.98, 0.99, 1.0),
    *(1.01, 1.02, 1.05, 1.1, 1.2, 1.3, 1.5, 1.75, 2.0, 3.0, 5.0, 10.0, 20.0),
)
"""Bin edges of the histogram of cycle times, in periods."""


class RowTap:
    """Passes rows to the page's buffer and counts the times between them.

    A tick calls `on_due` every `due_s`, and the tick after `again`.
    """

    def __init__(self, buffer: RowBuffer, period_s: float, due_s: float) -> None:
        self.edges_us = tuple(share * period_s * 1e6 for share in CYCLE_EDGES)
        self.counts = [0] * (len(self.edges_us) + 1)
        """Cycles by the time since the previous one; see `commands.bus_status.CycleHistogram`."""
        self.on_due: Callable[[], object] = lambda: None
        self.period_s = period_s
        self._buffer = buffer
        self._edges_ns = [edge_us * 1e3 for edge_us in self.edges_us]
        self._interval_ns = round(due_s * 1e9)
        self._last_ns = self._due_ns = 0
        self._again = False

    def take(self, values: list[float]) -> None:
        """Take the row of this cycle."""
        self._buffer.take(values)
        now_ns = time.perf_counter_ns()
        if self._last_ns:
            self.counts[bisect_right(self._edges_ns, now_ns - self._last_ns)] += 1
        self._last_ns = now_ns
        if now_ns >= self._due_ns:
            self._due_ns = now_ns + self._interval_ns
            self.on_due()
        elif self._again:
            self._again = False
            self.on_due()

    def again(self) -> None:
        """Call `on_due` in the next tick, because work remains."""
        self._again = True

    @property
    def end(self) -> int:
        """Number of rows so far."""
        return self._buffer.end

    def clear(self) -> None:
        """Reset the counts."""
        self.counts = [0] * len(self.counts)
