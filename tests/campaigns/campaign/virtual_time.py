"""An event loop whose time is simulated: it stands still while anything is done, and jumps where nothing is.

A run of seconds takes as long as its computing does, and every wait of it ends at the same instant in every
repetition. Worker threads cost no simulated time: the loop waits for them before it jumps.
"""

from __future__ import annotations

import asyncio
import selectors
import threading
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

THREAD_PATIENCE_S = 60.0
"""How long a worker thread may take, wall clock, before the run counts as stuck."""


class StuckError(Exception):
    """Nothing is due, nothing can come, and the run is not over."""


class _Selector(selectors.DefaultSelector):
    """Looks at its files without waiting; where the loop would sleep it moves the loop's time instead."""

    def __init__(self) -> None:
        super().__init__()
        self.loop: VirtualLoop | None = None

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        ready = super().select(0)
        loop = self.loop
        if ready or timeout == 0 or loop is None:
            return ready
        if loop.working:
            ready = super().select(THREAD_PATIENCE_S)
            if not ready:
                raise StuckError("a worker thread does not come to its end")
            return ready
        if timeout is None:
            raise StuckError("the run waits for something that nobody will do")
        loop.pass_time(timeout)
        return []


class VirtualLoop(asyncio.SelectorEventLoop):
    """Worker threads come one after the other, so that what they send has one order."""

    def __init__(self) -> None:
        selector = _Selector()
        super().__init__(selector)
        selector.loop = self
        self.now_s = 0.0
        self.working = 0
        """Pieces of work in threads that have not come to their end."""
        self.posted: set[str] = set()
        """Names of the threads that have called back."""
        self._clock_resolution = 1e-9
        self.workers = ThreadPoolExecutor(max_workers=1)
        self.set_default_executor(self.workers)

    def time(self) -> float:
        """Simulated time, seconds."""
        return self.now_s

    def pass_time(self, span_s: float) -> None:
        """Let time go by."""
        self.now_s += span_s

    def call_soon_threadsafe(self, callback: Callable[..., Any], *args: Any, context: Any = None) -> Any:
        """Call back from a thread."""
        self.posted.add(threading.current_thread().name)
        return super().call_soon_threadsafe(callback, *args, context=context)

    def run_in_executor(self, executor: Any, func: Callable[..., Any], *args: Any) -> Any:
        """Do work in a thread, and let time stand still meanwhile."""
        self.working += 1
        future = super().run_in_executor(executor, func, *args)
        future.add_done_callback(self._done)
        return future

    def _done(self, _future: object) -> None:
        self.working -= 1


class VirtualClock:
    """In the place of `servo_ctrl.io.clock.TimerfdClock`: ticks of simulated time, late ones where asked for.

    `late`: periods by which the next tick comes late, once each: so many are missed at one go.
    """

    def __init__(self, period_ns: int, on_tick: Callable[[int], None], late: list[int]) -> None:
        self.missed = 0
        self.lateness = Lateness()
        self._period_s = period_ns * 1e-9
        self._on_tick, self._late = on_tick, late
        self._due = 0
        self._begun_s = 0.0
        self._loop: asyncio.AbstractEventLoop | None = None
        self._timer: asyncio.TimerHandle | None = None

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Tick from one period from now on."""
        self._loop, self._begun_s = loop, loop.time()
        self._wait(1)

    def _wait(self, periods: int) -> None:
        if self._loop is not None:
            self._due += periods
            instant_s = self._begun_s + self._due * self._period_s
            self._timer = self._loop.call_at(instant_s, self._tick, periods)

    def _tick(self, elapsed: int) -> None:
        self.missed += elapsed - 1
        self.lateness.count += 1
        self._on_tick(elapsed)
        self._wait(1 + (self._late.pop() if self._late else 0))

    def close(self) -> None:
        """Tick no more."""
        if self._timer is not None:
            self._timer.cancel()
        self._loop = None


class Lateness:
    """Of ticks that are never late by the wall clock."""

    def __init__(self) -> None:
        self.count = 0
