"""Lockstep: simulated time passes at a SYNC only, so a run is as fast as the controller."""

from hil_sim.node.slave import Slave
from hil_sim.runner.bench import Bench


class Lockstep:
    """At each SYNC: advance by 1006h under the old outputs, apply the new ones, send the inputs."""

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        bench.on_sync = self._on_sync
        self.quiet_period_s: float | None = None

    def _on_sync(self, slaves: list[Slave]) -> None:
        bench = self._bench
        bench.advance_cycle()
        bench.synchronise(slaves)

    def on_quiet(self) -> None:
        """Do nothing: no time passes between SYNCs."""
