"""Measures resources of a process (memory, descriptors, threads, tasks), and estimates their growth."""

import asyncio
import gc
import os
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import theilslopes

Array = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

PAGE_MIB = os.sysconf("SC_PAGE_SIZE") / 2**20
BLOCKS = 24
"""Number of medians into which samples are pooled, so that neighbours are hardly correlated."""
BLOCKS_MIN = 8
"""Least number of medians for a verdict; chosen."""
DURATION_MIN_H = 0.25
"""Least duration of a trend, hours; chosen: in less, a pool that fills once looks like growth."""
FLAT_MIB_PER_H = 1.0
"""Growth that counts as none; chosen: 24 MiB a day."""
WARM_SHARE = 0.2
"""Share of the samples, at the beginning, that is left out because caches and pools fill; chosen."""


def rss_mib(pid: int | None = None) -> float:
    """Resident memory of a process (default: ours)."""
    return int(Path(f"/proc/{pid or os.getpid()}/statm").read_text().split()[1]) * PAGE_MIB


def descriptors(pid: int | None = None) -> int:
    """Open files, sockets, pipes and timers of a process (default: ours)."""
    return len(list(Path(f"/proc/{pid or os.getpid()}/fd").iterdir()))


POOL_PREFIX = "asyncio_"
"""Prefix of the names of the threads in the default executor of asyncio."""


class HeldResources(NamedTuple):
    """Resources of this process that must be the same after every run."""

    descriptors: int
    threads: tuple[str, ...]
    """Names of the threads, without those of the pool of asyncio, which start when they are first needed."""
    system_threads: int
    """Number of threads according to the kernel, including those of libraries; without the pool."""
    tasks: tuple[str, ...]
    children: int


def held_resources() -> HeldResources:
    """Return the resources after a garbage collection, without the calling task."""
    gc.collect()
    this_task = asyncio.current_task()
    tasks = [task for task in asyncio.all_tasks() if task is not this_task and not task.done()]
    descendants = [task / "children" for task in Path("/proc/self/task").iterdir()]
    threads = [thread.name for thread in threading.enumerate()]
    pooled = [name for name in threads if name.startswith(POOL_PREFIX)]
    return HeldResources(
        descriptors(),
        tuple(sorted(_unnumbered(name) for name in threads if name not in pooled)),
        len(descendants) - len(pooled),
        tuple(sorted(_unnumbered(task.get_name()) for task in tasks)),
        sum(len(file.read_text().split()) for file in descendants),
    )


def _unnumbered(name: str) -> str:
    """Remove the running number at the end of a thread or task name, which differs from run to run."""
    return name.rstrip("0123456789")


class Sample(NamedTuple):
    """Resources of the processes at one time of a run."""

    at_s: float
    machine_s: float
    """Machine time; 0 before the first cycle."""
    rss_mib: dict[str, float]
    """By role: controller, simulator, hub."""
    objects: int
    """Live objects of the controller, without those frozen at the first cycle and without the free lists of
    the allocator, which fill for minutes."""


def sample(machine_s: float, pids: dict[str, int], samples_kept: int) -> Sample:
    """Return a sample of now, without the `samples_kept` objects that the caller keeps itself."""
    memory = {role: rss_mib(pid) for role, pid in {"controller": os.getpid(), **pids}.items()}
    return Sample(time.monotonic(), machine_s, memory, len(gc.get_objects()) - samples_kept)


class Slope(NamedTuple):
    """Growth over time, the median of all pairwise slopes (Theil and Sen), with its 95 % interval."""

    per_h: float
    low: float
    high: float
    blocks: int
    over_h: float

    def verdict(self, flat: float) -> str:
        """Return "flat", "grows" or "too short to tell"; growth below `flat` per hour counts as none."""
        if self.blocks < BLOCKS_MIN or self.over_h < DURATION_MIN_H:
            return "too short to tell"
        if self.high <= flat:
            return "flat"
        return "grows" if self.low > flat else "too short to tell"

    def as_json(self, flat: float) -> dict[str, Any]:
        rounded = {name: float(f"{value:.4g}") for name, value in self._asdict().items()}
        return {**rounded, "blocks": self.blocks, "verdict": self.verdict(flat)}


def slope(hours: Sequence[float], values: Sequence[float]) -> Slope:
    """Return the slope of values over time, without the warm-up.

    In lockstep several samples can fall into one cycle, and so on one value of x. They are pooled first: the
    variance of Sen's interval (1968, eq. 2.6) subtracts the ties of x and of y, and with both it can fall
    below zero.
    """
    first = int(len(hours) * WARM_SHARE)
    x, y = _one_value_per_time(np.asarray(hours[first:]), np.asarray(values[first:]))
    blocks, over_h = min(BLOCKS, len(x)), float(np.ptp(x)) if len(x) else 0.0
    if blocks < 3:
        return Slope(np.nan, np.nan, np.nan, blocks, over_h)
    x, y = (np.array([np.median(part) for part in np.array_split(column, blocks)]) for column in (x, y))
    fit = theilslopes(y, x, alpha=0.95)
    return Slope(float(fit.slope), float(fit.low_slope), float(fit.high_slope), blocks, over_h)


def _one_value_per_time(x: Array, y: Array) -> tuple[Array, Array]:
    """Return distinct times in ascending order, and the median of the values at each."""
    times, of_time = np.unique(x, return_inverse=True)
    return times, np.array([np.median(y[of_time == i]) for i in range(len(times))])
