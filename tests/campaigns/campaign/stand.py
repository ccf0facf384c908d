"""The test stand of one run: unchanged daemon and simulator, with simulated time, wire and operator.

It replaces the bus, the real-time clock, the signals and the size of the parts of the recording, so that a
short run has several. The code of the daemon is unchanged.
"""

from __future__ import annotations

import contextlib
from functools import partial
from typing import TYPE_CHECKING, Any

from hil_sim.runner.bench import SimulatedMachine
from hil_sim.runner.pacing import Lockstep, RealTime
from servo_ctrl.daemon.learning import pulse_learning
from servo_ctrl.daemon.run import changed_files, run_recording, session, supervisor
from servo_ctrl.daemon.run.services import Services
from servo_ctrl.io.can_port import CanPort
from servo_ctrl.recording.recorder import Recorder
from tests.campaigns.campaign.broker import Broker
from tests.campaigns.campaign.learning import TwoStrokes
from tests.campaigns.campaign.patches import patched
from tests.campaigns.campaign.truth import TruthRecorder
from tests.campaigns.campaign.virtual_time import VirtualClock, VirtualLoop
from tests.campaigns.campaign.wire import Wire

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from tests.campaigns.campaign.machine import CampaignMachine

ROWS_PER_PART = 150
"""Rows in a part of the recording; chosen: a short run has several parts."""
QUIET_S = 0.01
"""Period at which the simulator in real time checks a quiet bus, seconds; chosen."""
LOOK_S = 0.02
"""Wall-clock period of the check for changed files, seconds; chosen: a run takes less than a second of it."""
RUN_LIMIT_S = 40.0
"""Simulated time after which a run counts as stuck."""
BUS = "localcan:campaign"


class Stand:
    """Calls `on_tick` after every tick of the daemon, for the operator and the faults."""

    def __init__(self, machine: CampaignMachine, folder: Path, pacing: str) -> None:
        self.machine, self.folder, self.pacing = machine, folder, pacing
        self.loop = VirtualLoop()
        self.wire = Wire(self.loop)
        self.bench = SimulatedMachine(machine.plant, self.wire.from_nodes)
        self.truth_recorder = TruthRecorder(self.bench, lambda: self.wire.cycle)
        self.wire.nodes = self.bench.handle
        self._pace()
        self.broker = Broker()
        self.services: Services | None = None
        """Services of the daemon; None until the nodes are booted."""
        self.handler: Any = None
        self.on_tick: Callable[[], None] = lambda: None
        self.signal: Callable[[str], None] = lambda _name: None
        """Handler of SIGTERM while the daemon handles signals."""
        self.late: list[int] = []
        """Periods by which ticks are late, see `VirtualClock`."""
        self.sdo_timeout_s = 5.0
        self.kill: Callable[[], object] = lambda: None
        """Cancels the daemon's task."""
        self.stages: list[tuple[int, int]] = []
        """(cycle of the wire, stage) at each change."""
        self.ticks = self.killed_ticks = 0
        self.killed_cycle: int | None = None

    @property
    def daemon(self) -> Any:
        """The daemon's machine."""
        assert self.services is not None
        return self.services.machine

    def _pace(self) -> None:
        if self.pacing == "lockstep":
            Lockstep(self.bench)
            self.wire.on_sync = lambda: self.loop.pass_time(1e-3)
            return
        pacing = RealTime(self.bench, self.loop.time)

        def poll_quiet_bus() -> None:
            if not self.wire.nodes_dead:
                pacing.on_quiet()
            self.loop.call_later(QUIET_S, poll_quiet_bus)

        self.loop.call_later(QUIET_S, poll_quiet_bus)

    def begin_next_run(self) -> None:
        """Prepare time, wire and hooks for another run of the daemon; the nodes keep their state."""
        loop = VirtualLoop()
        loop.now_s = self.loop.now_s
        self.loop = loop
        self.wire.begin_next_run(loop)
        self.late.clear()
        self.on_tick = lambda: None
        self._pace()

    def power_up(self) -> None:
        """Start the nodes."""
        self.bench.start()

    def advance_nodes(self, span_s: float) -> None:
        """Advance the time of the nodes on the bus without a controller."""
        for _ in range(round(span_s / 1e-3)):
            self.bench.advance(20)
            self.bench.run_timers()

    @contextlib.contextmanager
    def installed(self) -> Iterator[None]:
        """Replace bus, clock, signals and recorder of the daemon inside the block."""
        clock = partial(VirtualClock, late=self.late)
        with patched(
            (supervisor, "open_port", lambda spec: CanPort(self.wire.controller_port, spec)),  # type: ignore[arg-type]
            (supervisor, "stop_signals", self._signals),
            (supervisor, "uninterrupted", _uninterrupted),
            (supervisor, "LOCKSTEP_SDO_TIMEOUT_S", self.sdo_timeout_s),
            (session, "TimerfdClock", clock),
            (run_recording, "Recorder", _recorder),
            (pulse_learning, "LearningRun", TwoStrokes),
            (changed_files, "POLL_S", LOOK_S),
            (Services, "begin", self._with_observed_ticks(Services.begin)),
        ):
            yield

    @contextlib.contextmanager
    def _signals(self, on_signal: Callable[[str], None]) -> Iterator[None]:
        self.signal = on_signal
        yield
        self.signal = lambda _name: None

    def _with_observed_ticks(self, begin: Callable[..., None]) -> Callable[..., None]:
        def begin_and_observe(services: Services) -> None:
            begin(services)
            self.services, self.handler = services, services.handler
            machine: Any = services.machine
            tick = machine.tick
            self.stages.append((max(self.wire.cycle, 0), int(machine.stage)))

            def observed_tick(cycle: int, elapsed: int, inputs: Any) -> Any:
                payloads = tick(cycle, elapsed, inputs)
                self.ticks += 1
                if int(machine.stage) != self.stages[-1][1]:
                    self.stages.append((self.wire.cycle, int(machine.stage)))
                self.on_tick()
                return payloads

            machine.tick = observed_tick

        return begin_and_observe


def _recorder(directory: Path, channels: Any, header: Any, *, wait_s: float) -> Recorder:
    """Make a recorder that waits for the disk, because simulated time is faster."""
    return Recorder(directory, channels, header, wait_s=max(wait_s, 10.0), rows_per_part=ROWS_PER_PART)


@contextlib.contextmanager
def _uninterrupted(*, fifo: bool, realtime: bool) -> Iterator[None]:
    """Leave the collector as it is, because only simulated time counts."""
    assert not fifo
    yield
