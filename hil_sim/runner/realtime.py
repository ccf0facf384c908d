"""Real time: the plant follows the wall clock, read when a SYNC or an asynchronous RPDO is received."""

import time
from collections.abc import Callable

from hil_sim.node.slave import Slave
from hil_sim.runner.bench import Bench

QUIET_PERIOD_S = 0.01
LONGEST_CATCH_UP_S = 0.5
"""Bounds one advance: a process that was suspended does not simulate the time it slept."""


class RealTime:
    """`now_s` is a monotonic clock; the plant never runs ahead of it."""

    def __init__(self, bench: Bench, now_s: Callable[[], float] = time.monotonic) -> None:
        self._bench = bench
        self._now_s = now_s
        self._reached_s = self._served_s = now_s()  # by the plant, by the timers of the nodes
        self.quiet_period_s: float | None = QUIET_PERIOD_S
        bench.on_sync = self._on_sync
        bench.on_async = self._catch_up

    def _catch_up(self) -> None:
        now_s = self._now_s()
        if now_s - self._reached_s > LONGEST_CATCH_UP_S:
            self._reached_s = now_s - LONGEST_CATCH_UP_S
        substep_s = self._bench.substep_us * 1e-6
        substeps = int((now_s - self._reached_s) / substep_s)
        self._bench.advance(substeps)
        self._reached_s += substeps * substep_s

    def _on_sync(self, slaves: list[Slave]) -> None:
        self._catch_up()
        self._bench.synchronise(slaves)
        self._served_s = self._reached_s

    def on_quiet(self) -> None:
        """Keep time, heartbeats and event-driven PDOs going on a quiet bus."""
        if self._now_s() - self._served_s < 0.5 * QUIET_PERIOD_S:
            return  # the bus is not quiet: the SYNCs serve the timers
        self._catch_up()
        self._bench.run_timers()
        self._served_s = self._reached_s
