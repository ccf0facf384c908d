"""How often a page refreshes: less often while the event loop lags, so that STOP is never behind pictures."""

from __future__ import annotations

FASTEST_S = 1.0 / 30.0
SLOWEST_S = 0.25
LATE = 1.5
"""A refresh that comes so much later than it was due is late; one in ten may be."""
SLOWER, FASTER = 1.1, 0.97


def next_interval(interval_s: float, elapsed_s: float) -> float:
    """The interval to wait next; `elapsed_s` have passed since the last refresh, not `interval_s`."""
    factor = SLOWER if elapsed_s > LATE * interval_s else FASTER
    return min(max(interval_s * factor, FASTEST_S), SLOWEST_S)
