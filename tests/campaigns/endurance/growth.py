"""What grows, by line of code: memory that is still held after a run, less that after the run before."""

import gc
import tracemalloc
from collections.abc import Awaitable, Callable
from typing import Any

FRAMES = 8
WARM_RUNS = 1
TOLD = 15
LEAST_BYTES = 1024


async def top_growth(run: Callable[[], Awaitable[Any]]) -> list[str]:
    """Run some more under tracemalloc (several times slower): where the last run's growth was allocated."""
    tracemalloc.start(FRAMES)
    try:
        for _ in range(WARM_RUNS):
            await run()
        before = _snapshot()
        await run()
        after = _snapshot()
    finally:
        tracemalloc.stop()
    found = [entry for entry in after.compare_to(before, "traceback") if entry.size_diff >= LEAST_BYTES]
    return [_told(entry) for entry in found[:TOLD]]


def _snapshot() -> tracemalloc.Snapshot:
    gc.collect()
    ours = tracemalloc.Filter(inclusive=False, filename_pattern=tracemalloc.__file__)
    return tracemalloc.take_snapshot().filter_traces([ours])


def _told(entry: tracemalloc.StatisticDiff) -> str:
    places = [f"{frame.filename.rpartition('site-packages/')[2]}:{frame.lineno}" for frame in entry.traceback]
    return f"{entry.size_diff} bytes in {entry.count_diff} blocks: {' < '.join(reversed(places))}"
