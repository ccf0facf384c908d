"""The timerfd clock, by counting: no test here depends on how fast this computer is."""

import asyncio
import math
import select
import sys
import time

import pytest

from servo_ctrl.io.clock import Lateness, TimerfdClock

linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="timerfd is Linux")
PERIOD_NS = 1_000_000


@linux
async def test_ticks_and_missed_ticks_together_are_the_time_that_passed() -> None:
    served: list[int] = []
    enough = asyncio.Event()

    def on_tick(elapsed: int) -> None:
        served.append(elapsed)
        if sum(served) >= 50:
            enough.set()

    clock = TimerfdClock(PERIOD_NS, on_tick)
    start_ns = time.monotonic_ns()
    clock.start(asyncio.get_running_loop(), start_ns + PERIOD_NS)
    await asyncio.wait_for(enough.wait(), 30.0)
    passed = (time.monotonic_ns() - start_ns) // PERIOD_NS
    clock.close()
    assert 50 <= sum(served) <= passed
    assert clock.missed == sum(served) - len(served)
    assert clock.lateness.count == len(served)


@linux
async def test_unserved_ticks_are_counted_at_once() -> None:
    served: list[int] = []
    clock = TimerfdClock(PERIOD_NS, served.append)
    # a first tick 100 periods ago: absolute time, so that all of them are due
    clock.start(asyncio.get_running_loop(), time.monotonic_ns() - 99 * PERIOD_NS)
    assert select.select([clock.fileno], [], [], 5.0)[0]
    clock.serve()
    clock.close()
    assert len(served) == 1
    assert served[0] >= 100
    assert clock.missed == served[0] - 1
    # late by the whole time since the first of them, not since the last
    assert clock.lateness.percentile_us(1.0) >= min(99 * PERIOD_NS // 1000, Lateness.BINS)


@linux
async def test_no_tick_is_served_before_its_instant() -> None:
    start_ns = time.monotonic_ns() + PERIOD_NS
    early: list[int] = []
    served: list[int] = []
    enough = asyncio.Event()

    def on_tick(elapsed: int) -> None:
        served.append(elapsed)
        if time.monotonic_ns() < start_ns + (sum(served) - 1) * PERIOD_NS:
            early.append(len(served))
        if len(served) >= 50:
            enough.set()

    clock = TimerfdClock(PERIOD_NS, on_tick)
    clock.start(asyncio.get_running_loop(), start_ns)
    await asyncio.wait_for(enough.wait(), 30.0)
    clock.close()
    assert early == []


@linux
async def test_tick_that_is_announced_but_not_due_is_no_missed_one() -> None:
    served: list[int] = []
    clock = TimerfdClock(
        3_600_000_000_000, served.append
    )  # announced 100 us ahead: the second never is due here
    clock.start(asyncio.get_running_loop(), time.monotonic_ns())
    clock.serve()
    clock.close()
    assert (served, clock.missed) == ([1], 0)


@linux
async def test_serving_early_does_nothing() -> None:
    served: list[int] = []
    clock = TimerfdClock(PERIOD_NS, served.append)
    clock.start(asyncio.get_running_loop(), time.monotonic_ns() + 3_600_000_000_000)
    clock.serve()
    clock.close()
    assert served == []


@linux
async def test_closed_clock_is_silent_and_closes_twice() -> None:
    clock = TimerfdClock(PERIOD_NS, lambda _elapsed: pytest.fail("ticked"))
    clock.start(asyncio.get_running_loop())
    clock.close()
    clock.close()
    await asyncio.sleep(0)


def test_percentiles_are_those_of_the_bins() -> None:
    lateness = Lateness()
    for late_us in [10] * 50 + [20] * 49 + [5000]:
        lateness.add(late_us * 1000 + 999)
    assert [lateness.percentile_us(share) for share in (0.5, 0.51, 0.99, 0.999)] == [10.0, 20.0, 20.0, 5000.0]


def test_lateness_beyond_the_bins_and_before_the_tick_is_kept() -> None:
    lateness = Lateness()
    lateness.add(10**12)
    lateness.add(-5)
    assert (lateness.percentile_us(0.5), lateness.percentile_us(1.0)) == (0.0, float(Lateness.BINS))


def test_without_ticks_there_is_no_percentile() -> None:
    assert math.isnan(Lateness().percentile_us(0.5))
