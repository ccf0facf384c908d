"""Refreshes live charts 30 times a second, and less often while the event loop lags.

STOP is handled by the same loop: pictures must not delay it.
"""

import time
from collections.abc import Awaitable, Callable

from nicegui import ui

SHORTEST_S = 1.0 / 30.0
LONGEST_S = 0.25
LATE_RATIO = 1.5
"""Elapsed time over interval above which a refresh counts as late."""
LENGTHEN, SHORTEN = 1.1, 0.97
"""Factors after a late and after a punctual refresh; the interval rests where one in four is late."""


def next_interval(interval_s: float, elapsed_s: float) -> float:
    """The next interval, when `elapsed_s` have passed since the last refresh instead of `interval_s`."""
    factor = LENGTHEN if elapsed_s > LATE_RATIO * interval_s else SHORTEN
    return min(max(interval_s * factor, SHORTEST_S), LONGEST_S)


def refresh_paced(refresh: Callable[[], Awaitable[None] | None]) -> None:
    """Call `refresh` for as long as the page is open, at the interval that the event loop bears."""
    last_s = time.monotonic()

    async def call() -> None:
        nonlocal last_s
        now_s = time.monotonic()
        timer.interval = next_interval(timer.interval, now_s - last_s)
        last_s = now_s
        result = refresh()
        if result is not None:
            await result

    timer = ui.timer(SHORTEST_S, call)
