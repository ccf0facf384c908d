"""The round trip of the bus, measured in the first two seconds of cycles: no drive gets power before.

The ticks alone were judged by `self_test`; here nodes, bus and the way through this computer take part:
from the SYNC to the last input, as the cycle takes it.
"""

import time
from collections.abc import Callable

from servo_ctrl.daemon.cycle.cycle import Inputs
from servo_ctrl.daemon.run.self_test import ADVICE, LATE_SHARE, TEST_S
from servo_ctrl.io.clock import Lateness


class RoundTrip:
    """Measures cycles of this period until two seconds of them are over, then says what is not held."""

    def __init__(
        self,
        period_s: float,
        say: Callable[[str], None],
        on_over: Callable[[], None] = lambda: None,
        *,
        now_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self.over = False
        self._left = max(round(TEST_S / period_s), 1)
        self._period_s, self._say, self._now_ns = period_s, say, now_ns
        self._on_over = on_over
        self._times = Lateness()
        self._late = 0
        self._sent_ns = 0

    def begun(self) -> None:
        """A SYNC went out."""
        self._sent_ns = self._now_ns()

    def answered(self, inputs: Inputs) -> bool:
        """The inputs of this SYNC are there, or did not come in time; False once all is measured."""
        if None in inputs:
            self._late += 1
        else:
            self._times.add(self._now_ns() - self._sent_ns)
        self._left -= 1
        if not self._left:
            self.over = True
            self._on_over()
            if problem := verdict(self._period_s * 1e3, self._times, self._late):
                self._say(problem)
        return not self.over


def verdict(period_ms: float, times: Lateness, late: int) -> str:
    """Judge the round trips that were over in time, and how many were not; "" where all is well."""
    cycles = times.count + late
    if late <= LATE_SHARE * cycles:
        return ""
    figures = f"of {cycles} cycles {late} had not all inputs before the next SYNC"
    if times.count:
        figures += f"; the longest other round trip took {times.percentile_us(1.0) * 1e-3:.1f} ms"
    return f"this computer and its bus do not hold {period_ms:g} ms: {figures}; {ADVICE}"
