"""Finds growth of memory by line of code: memory held after a run minus that after the run before."""

import gc
import tracemalloc
from collections.abc import Awaitable, Callable
from typing import Any

TRACEBACK_FRAMES = 8
"""Frames of a traceback that distinguish two allocations; chosen."""
WARM_RUNS = 1
"""Runs before the first snapshot, in which caches and pools fill; chosen."""
ENTRIES_MAX = 15
BYTES_MIN = 1024
"""Bound the entries of the report and the growth of each, bytes; chosen."""


async def top_growth(run: Callable[[], Awaitable[Any]]) -> list[str]:
    """Repeat the run under tracemalloc, several times slower; return where the last growth was allocated."""
    tracemalloc.start(TRACEBACK_FRAMES)
    try:
        for _ in range(WARM_RUNS):
            await run()
        before = _snapshot()
        await run()
        after = _snapshot()
    finally:
        tracemalloc.stop()
    growth = [entry for entry in after.compare_to(before, "traceback") if entry.size_diff >= BYTES_MIN]
    return [_growth_text(entry) for entry in growth[:ENTRIES_MAX]]


def _snapshot() -> tracemalloc.Snapshot:
    gc.collect()
    without_tracemalloc = tracemalloc.Filter(inclusive=False, filename_pattern=tracemalloc.__file__)
    return tracemalloc.take_snapshot().filter_traces([without_tracemalloc])


def _growth_text(entry: tracemalloc.StatisticDiff) -> str:
    places = [f"{frame.filename.rpartition('site-packages/')[2]}:{frame.lineno}" for frame in entry.traceback]
    return f"{entry.size_diff} bytes in {entry.count_diff} blocks: {' < '.join(reversed(places))}"
