"""An event loop with simulated time, which stands still while code runs and jumps to the next timer.

A run takes as long as its computation, and each wait ends at the same time in every repetition. Worker
threads take no simulated time: the loop waits for them before it jumps.
"""

from __future__ import annotations

import asyncio
import selectors
import threading
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

THREAD_TIME_MAX_S = 60.0
"""Wall-clock time of a worker thread after which the run counts as stuck; chosen."""


class StuckError(Exception):
    """The run has not ended, and no timer or thread can continue it."""


class _Selector(selectors.DefaultSelector):
    """Polls the files without waiting, and advances the time of the loop instead of sleeping."""

    def __init__(self) -> None:
        super().__init__()
        self.loop: VirtualLoop | None = None

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        ready = super().select(0)
        loop = self.loop
        if ready or timeout == 0 or loop is None:
            return ready
        if loop.working:
            ready = super().select(THREAD_TIME_MAX_S)
            if not ready:
                raise StuckError("a worker thread does not end")
            return ready
        if timeout is None:
            raise StuckError("the run waits for an event that cannot happen")
        loop.pass_time(timeout)
        return []


class VirtualLoop(asyncio.SelectorEventLoop):
    """An event loop with one worker thread, so that the order of its frames is reproducible."""

    def __init__(self) -> None:
        selector = _Selector()
        super().__init__(selector)
        selector.loop = self
        self.now_s = 0.0
        self.working = 0
        """Number of unfinished calls in worker threads."""
        self.threads_that_called_back: set[str] = set()
        """Names of the threads that have called back."""
        self._clock_resolution = 1e-9
        self.workers = ThreadPoolExecutor(max_workers=1)
        self.set_default_executor(self.workers)

    def time(self) -> float:
        """Simulated time, seconds."""
        return self.now_s

    def pass_time(self, span_s: float) -> None:
        """Advance the simulated time."""
        self.now_s += span_s

    def call_soon_threadsafe(self, callback: Callable[..., Any], *args: Any, context: Any = None) -> Any:
        """Schedule a callback from a thread, and note the name of the thread."""
        self.threads_that_called_back.add(threading.current_thread().name)
        return super().call_soon_threadsafe(callback, *args, context=context)

    def run_in_executor(self, executor: Any, func: Callable[..., Any], *args: Any) -> Any:
        """Call a function in a worker thread while the simulated time stands still."""
        self.working += 1
        future = super().run_in_executor(executor, func, *args)
        future.add_done_callback(self._done)
        return future

    def _done(self, _future: object) -> None:
        self.working -= 1


class VirtualClock:
    """Replaces `servo_ctrl.io.clock.TimerfdClock` by ticks of simulated time.

    `late`: each entry makes one tick late by this number of periods.
    """

    def __init__(self, period_ns: int, on_tick: Callable[[int], None], late: list[int]) -> None:
        self.missed = 0
        self.lateness = Lateness()
        self._period_s = period_ns * 1e-9
        self._on_tick, self._late = on_tick, late
        self._due = 0
        self._start_s = 0.0
        self._loop: asyncio.AbstractEventLoop | None = None
        self._timer: asyncio.TimerHandle | None = None

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Start ticking; the first tick is one period from now."""
        self._loop, self._start_s = loop, loop.time()
        self._wait(1)

    def _wait(self, periods: int) -> None:
        if self._loop is not None:
            self._due += periods
            instant_s = self._start_s + self._due * self._period_s
            self._timer = self._loop.call_at(instant_s, self._tick, periods)

    def _tick(self, elapsed: int) -> None:
        self.missed += elapsed - 1
        self.lateness.count += 1
        self._on_tick(elapsed)
        self._wait(1 + (self._late.pop() if self._late else 0))

    def close(self) -> None:
        """Stop ticking."""
        if self._timer is not None:
            self._timer.cancel()
        self._loop = None


class Lateness:
    """Counts ticks, none of which is late by the wall clock."""

    def __init__(self) -> None:
        self.count = 0
