"""Clock of real-time pacing: a periodic timerfd with absolute instants, which counts missed ticks.

asyncio rounds its timers up to a millisecond, so the kernel provides the period. Lockstep needs no clock:
each cycle starts the next one.
"""

import asyncio
import contextlib
import ctypes
import math
import os
import struct
import sys
import time
from collections.abc import Callable

from servo_ctrl.errors import ServoCtrlError

CLOCK_MONOTONIC = 1
TFD_NONBLOCK = os.O_NONBLOCK
TFD_CLOEXEC = getattr(os, "O_CLOEXEC", 0)
TFD_TIMER_ABSTIME = 1
_ITIMERSPEC = struct.Struct("@llll")  # interval s, ns; first expiry s, ns
LEAD_NS = 100_000
LEAD_PERIODS = 10
"""The clock wakes up 100 us, at most a tenth of the period, before a tick and then polls the time, because
waking up a processor takes that long. Chosen: `cyclictest` on virtual machines is later in 1 % of ticks."""


class ClockError(ServoCtrlError):
    """This system has no timerfd."""


class Lateness:
    """Histogram of the lateness of ticks, with 1 us bins, so that its memory is bounded."""

    BINS = 20_000

    def __init__(self) -> None:
        self._counts = [0] * (self.BINS + 1)

    def add(self, late_ns: int) -> None:
        """Count one tick; the last bin holds those later than 20 ms."""
        self._counts[min(max(late_ns, 0) // 1000, self.BINS)] += 1

    @property
    def count(self) -> int:
        """Number of ticks."""
        return sum(self._counts)

    def percentile_us(self, share: float) -> float:
        """Return the lateness in us that this share (0..1) of ticks does not exceed; NaN without any."""
        rank = share * self.count
        counted = 0
        for late_us, count in enumerate(self._counts):
            counted += count
            if count and counted >= rank:
                return float(late_us)
        return math.nan


class TimerfdClock:
    """Calls `on_tick(elapsed)` every `period_ns` of CLOCK_MONOTONIC; `elapsed` includes missed ticks.

    The instants are absolute: a late tick does not shift the later ones.
    """

    def __init__(self, period_ns: int, on_tick: Callable[[int], None]) -> None:
        if not sys.platform.startswith("linux"):
            raise ClockError("real-time pacing needs Linux (timerfd); use --pacing lockstep")
        self.period_ns = period_ns
        self.missed = 0
        """Ticks that passed before an earlier one was served."""
        self.lateness = Lateness()
        self._lead_ns = min(LEAD_NS, period_ns // LEAD_PERIODS)
        self._served_ns = 0
        """Instant of the last tick that was served or missed."""
        self._announced = 0
        """Ticks that the timer has announced since."""
        self._on_tick = on_tick
        self._libc = ctypes.CDLL(None, use_errno=True)
        self._fd = self._libc.timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC)
        if self._fd < 0:
            raise ClockError(f"timerfd_create failed: {os.strerror(ctypes.get_errno())}")
        self._loop: asyncio.AbstractEventLoop | None = None

    @property
    def fileno(self) -> int:
        """File descriptor, readable shortly before a tick is due."""
        return int(self._fd)

    def start(self, loop: asyncio.AbstractEventLoop, first_ns: int | None = None) -> None:
        """Start ticking in `loop`, at `first_ns` (CLOCK_MONOTONIC) first, or one period from now."""
        start_ns = time.monotonic_ns() + self.period_ns if first_ns is None else first_ns
        first_s, first_rest_ns = divmod(start_ns - self._lead_ns, 1_000_000_000)
        timer = _ITIMERSPEC.pack(*divmod(self.period_ns, 1_000_000_000), first_s, first_rest_ns)
        if self._libc.timerfd_settime(self._fd, TFD_TIMER_ABSTIME, timer, None) != 0:
            raise ClockError(f"timerfd_settime failed: {os.strerror(ctypes.get_errno())}")
        self._served_ns = start_ns - self.period_ns
        loop.add_reader(self._fd, self.serve)
        self._loop = loop

    def serve(self) -> None:
        """Call `on_tick` once for all ticks that are due, after awaiting one that is announced."""
        if self._loop is None:
            return
        with contextlib.suppress(BlockingIOError):
            self._announced += int.from_bytes(os.read(self._fd, 8), sys.byteorder)
        if not self._announced:
            return
        due_ns = self._served_ns + self.period_ns
        now_ns = time.monotonic_ns()
        while now_ns < due_ns:
            now_ns = time.monotonic_ns()
        elapsed = min((now_ns - self._served_ns) // self.period_ns, self._announced)
        self.missed += elapsed - 1
        # measured from the first due instant: a wake-up that missed ticks counts with its full lateness
        self.lateness.add(now_ns - due_ns)
        self._served_ns += elapsed * self.period_ns
        self._announced -= elapsed
        if self._announced:  # the next tick is announced already, and not yet due
            self._loop.call_soon(self.serve)
        self._on_tick(elapsed)

    def close(self) -> None:
        """Stop ticking and close the descriptor."""
        if self._loop is not None:
            self._loop.remove_reader(self._fd)
            self._loop = None
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1
