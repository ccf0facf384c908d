"""Pacing of simulated time: it advances with the SYNC (lockstep), or with the wall clock (real time)."""

import time
from collections.abc import Callable

from hil_sim.node.slave import Slave
from hil_sim.runner.bench import SimulatedMachine

QUIET_PERIOD_S = 0.01
"""Period in which timers are served on a bus without SYNCs (chosen: well below any heartbeat time)."""
LONGEST_CATCH_UP_S = 0.5
"""Bounds one advance: a suspended process does not simulate the time of its suspension (chosen)."""


class Lockstep:
    """Advances at each SYNC by 1006h under the old outputs, then applies the new ones and sends the inputs.

    Simulated time advances at a SYNC only, so a run is as fast as the controller.
    """

    quiet_period_s: float | None = None

    def __init__(self, bench: SimulatedMachine) -> None:
        self._bench = bench
        bench.frames.on_sync = self._on_sync
        bench.sync_substeps, bench.on_synced = bench.substeps_of_cycle, _nothing

    def _on_sync(self, slaves: list[Slave]) -> None:
        self._bench.advance_cycle()
        self._bench.synchronise(slaves)

    def on_quiet(self) -> None:
        """Do nothing: no time passes between SYNCs."""


class RealTime:
    """The plant follows the monotonic clock `now_s`, read at each SYNC and asynchronous RPDO."""

    quiet_period_s: float | None = QUIET_PERIOD_S

    def __init__(self, bench: SimulatedMachine, now_s: Callable[[], float] = time.monotonic) -> None:
        self._bench = bench
        self._now_s = now_s
        self._reached_s = self._served_s = now_s()  # time of the plant, and of the last service of the timers
        bench.frames.on_sync, bench.frames.on_async = self._on_sync, self._catch_up
        bench.sync_substeps, bench.on_synced = self._substeps_due, self._on_synced

    def _substeps_due(self) -> int:
        """Substeps by which the plant is behind the clock."""
        now_s = self._now_s()
        self._reached_s = max(self._reached_s, now_s - LONGEST_CATCH_UP_S)
        return int((now_s - self._reached_s) / (self._bench.substep_us * 1e-6))

    def _catch_up(self) -> None:
        substeps = self._substeps_due()
        self._bench.advance(substeps)
        self._reached_s += substeps * (self._bench.substep_us * 1e-6)

    def _on_sync(self, slaves: list[Slave]) -> None:
        self._catch_up()
        self._bench.synchronise(slaves)
        self._served_s = self._reached_s

    def _on_synced(self, substeps: int) -> None:
        self._reached_s += substeps * (self._bench.substep_us * 1e-6)
        self._served_s = self._reached_s

    def on_quiet(self) -> None:
        """Advance the plant and serve heartbeats and event-driven PDOs on a bus without SYNCs."""
        if self._now_s() - self._served_s < 0.5 * QUIET_PERIOD_S:
            return  # SYNCs arrive, and serve the timers
        self._catch_up()
        self._bench.run_timers()
        self._served_s = self._reached_s


def _nothing(_substeps: int) -> None:
    pass
