"""Measures the round trip on the bus during the first two seconds of cycles, before any drive gets power.

`self_test` judges the ticks alone. The round trip, from the SYNC until the cycle has the last input, also
contains nodes, bus and the computer's network stack.
"""

import time
from collections.abc import Callable, Sequence
from functools import partial

from servo_ctrl.axis.servo import AxisServo
from servo_ctrl.daemon.cycle.cycle import Cycle, Inputs
from servo_ctrl.daemon.run.self_test import ADVICE, LATE_SHARE, TEST_S
from servo_ctrl.io.clock import Lateness


class RoundTrip:
    """Measures two seconds of cycles, then reports whether computer and bus hold the period."""

    def __init__(
        self,
        period_s: float,
        note: Callable[[str], None],
        on_over: Callable[[], None] = lambda: None,
        *,
        now_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self.over = False
        self._cycles_left = max(round(TEST_S / period_s), 1)
        self._period_s, self._note, self._now_ns = period_s, note, now_ns
        self._on_over = on_over
        self._round_trips = Lateness()
        self._late = 0
        self._sent_ns = 0

    def sync_sent(self) -> None:
        """Note the time of a SYNC."""
        self._sent_ns = self._now_ns()

    def cycle_complete(self, inputs: Inputs) -> bool:
        """Measure the round trip of a cycle with these inputs; return False after the last cycle."""
        if None in inputs:
            self._late += 1
        else:
            self._round_trips.add(self._now_ns() - self._sent_ns)
        self._cycles_left -= 1
        if not self._cycles_left:
            self.over = True
            self._on_over()
            if problem := verdict(self._period_s * 1e3, self._round_trips, self._late):
                self._note(problem)
        return not self.over


def measure_round_trip(
    cycle: Cycle, servos: Sequence[AxisServo], period_s: float, note: Callable[[str], None]
) -> None:
    """Measure the round trip in the first cycles, and allow power only afterwards."""

    def allow_power(*, allowed: bool) -> None:
        for servo in servos:
            servo.allow_power(allowed=allowed)

    allow_power(allowed=False)
    cycle.trial = RoundTrip(period_s, note, partial(allow_power, allowed=True))


def verdict(period_ms: float, times: Lateness, late: int) -> str:
    """Judge the round trips completed in time and the number of late ones; return "" if all is well."""
    cycles = times.count + late
    if late <= LATE_SHARE * cycles:
        return ""
    figures = f"of {cycles} cycles {late} lacked inputs at the next SYNC"
    if times.count:
        figures += f"; the longest other round trip took {times.percentile_us(1.0) * 1e-3:.1f} ms"
    return f"this computer and its bus do not keep a period of {period_ms:g} ms: {figures}; {ADVICE}"
