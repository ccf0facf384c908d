"""Tests whether this computer holds the period: two seconds of ticks before the bus is opened."""

import asyncio

from servo_ctrl.axis.fault_bounds import GAP_TOLERATED_S
from servo_ctrl.io.clock import Lateness, TimerfdClock

TEST_S = 2.0
LATE_SHARE = 1e-3
"""Share of the ticks that may be late by a period; chosen."""
MULTIPLES = (1, 2, 5, 10, 20)
"""Multiples of the period, of which the message names the shortest that is kept; chosen."""
ADVICE = "give it less to do, use --fifo, or set a longer bus.sync_period_us"


async def objection(period_ns: int) -> str:
    """Tick for two seconds like the cycle; return why the computer does not keep the period, else ""."""
    clock = TimerfdClock(period_ns, _nothing)
    clock.start(asyncio.get_running_loop())
    try:
        await asyncio.sleep(TEST_S)
    finally:
        clock.close()
    return verdict(period_ns * 1e-6, clock.lateness, clock.missed)


def verdict(period_ms: float, lateness: Lateness, missed: int) -> str:
    """Judge the lateness of the served ticks and the number of missed ones; return "" if all is well."""
    latest_ms, usual_ms = lateness.percentile_us(1.0) * 1e-3, lateness.percentile_us(1.0 - LATE_SHARE) * 1e-3
    gap_ms = GAP_TOLERATED_S * 1e3
    ticks = lateness.count + missed
    figures = f"of {ticks} ticks {missed} were missed, the latest was served {latest_ms:.1f} ms late"
    if latest_ms >= gap_ms:
        return f"this computer stalls for {gap_ms:g} ms and more: {figures}; {ADVICE}"
    kept_ms = [multiple * period_ms for multiple in MULTIPLES if usual_ms < multiple * period_ms]
    if kept_ms and kept_ms[0] == period_ms:
        return ""
    kept = f"does not keep a period of {period_ms:g} ms"
    if kept_ms:
        kept = f"keeps a period of {kept_ms[0]:g} ms, not {period_ms:g} ms"
    return f"this computer {kept}: {figures}; {ADVICE}"


def _nothing(_elapsed: int) -> None:
    """Do nothing at a tick."""
