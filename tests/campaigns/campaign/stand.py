"""One run: the daemon as it is, the simulator as it is, and simulated time, wire and operator between them.

What the daemon is given in the place of its own: the bus, the real-time clock, the signals, smaller chunks of
the recording (so that a short run has several). Nothing in it is bent.
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
from tests.campaigns.campaign.truth import Witness
from tests.campaigns.campaign.virtual_time import VirtualClock, VirtualLoop
from tests.campaigns.campaign.wire import Wire

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from tests.campaigns.campaign.machine import CampaignMachine

ROWS_PER_PART = 150
QUIET_S = 0.01
LOOK_S = 0.02
"""By the wall clock, between two looks at the files: a run takes no second of it."""
RUN_LIMIT_S = 40.0
"""Simulated time after which a run counts as stuck."""
BUS = "localcan:campaign"


class Stand:
    """`on_tick(stand)` is called after every tick of the daemon: there the operator and the faults act."""

    def __init__(self, machine: CampaignMachine, folder: Path, pacing: str) -> None:
        self.machine, self.folder, self.pacing = machine, folder, pacing
        self.loop = VirtualLoop()
        self.wire = Wire(self.loop)
        self.bench = SimulatedMachine(machine.plant, self.wire.from_nodes)
        self.witness = Witness(self.bench, lambda: self.wire.cycle)
        self.wire.nodes = self.bench.handle
        self._pace()
        self.broker = Broker()
        self.services: Services | None = None
        """There once the nodes are booted."""
        self.handler: Any = None
        self.on_tick: Callable[[], None] = lambda: None
        self.signal: Callable[[str], None] = lambda _name: None
        """What SIGTERM would call; there while the daemon listens to signals."""
        self.late: list[int] = []
        """See `VirtualClock`."""
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
        real = RealTime(self.bench, self.loop.time)

        def quiet() -> None:
            if not self.wire.nodes_dead:
                real.on_quiet()
            self.loop.call_later(QUIET_S, quiet)

        self.loop.call_later(QUIET_S, quiet)

    def begin_again(self) -> None:
        """Time, wire and surroundings for another life of the daemon; the nodes are as they are."""
        loop = VirtualLoop()
        loop.now_s = self.loop.now_s
        self.loop = loop
        self.wire.begin_again(loop)
        self.late.clear()
        self.on_tick = lambda: None
        self._pace()

    def power_up(self) -> None:
        """The nodes come on the bus."""
        self.bench.start()

    def afterlife(self, span_s: float) -> None:
        """Time goes on for the nodes that are left on the bus."""
        for _ in range(round(span_s / 1e-3)):
            self.bench.advance(20)
            self.bench.run_timers()

    @contextlib.contextmanager
    def installed(self) -> Iterator[None]:
        """The daemon's surroundings are ours while this lasts."""
        clock = partial(VirtualClock, late=self.late)
        with patched(
            (supervisor, "open_port", lambda spec: CanPort(self.wire.end, spec)),  # type: ignore[arg-type]
            (supervisor, "stop_signals", self._signals),
            (supervisor, "uninterrupted", _uninterrupted),
            (supervisor, "LOCKSTEP_SDO_TIMEOUT_S", self.sdo_timeout_s),
            (session, "TimerfdClock", clock),
            (run_recording, "Recorder", _recorder),
            (pulse_learning, "LearningRun", TwoStrokes),
            (changed_files, "LOOK_S", LOOK_S),
            (Services, "begin", self._begun(Services.begin)),
        ):
            yield

    @contextlib.contextmanager
    def _signals(self, on_signal: Callable[[str], None]) -> Iterator[None]:
        self.signal = on_signal
        yield
        self.signal = lambda _name: None

    def _begun(self, begin: Callable[..., None]) -> Callable[..., None]:
        def begun(services: Services) -> None:
            begin(services)
            self.services, self.handler = services, services.handler
            machine: Any = services.machine
            tick = machine.tick
            self.stages.append((max(self.wire.cycle, 0), int(machine.stage)))

            def ticked(cycle: int, elapsed: int, inputs: Any) -> Any:
                payloads = tick(cycle, elapsed, inputs)
                self.ticks += 1
                if int(machine.stage) != self.stages[-1][1]:
                    self.stages.append((self.wire.cycle, int(machine.stage)))
                self.on_tick()
                return payloads

            machine.tick = ticked

        return begun


def _recorder(directory: Path, channels: Any, header: Any, *, wait_s: float) -> Recorder:
    """Simulated time is faster than the disk: it waits, as lockstep does, unless a fault says otherwise."""
    return Recorder(directory, channels, header, wait_s=max(wait_s, 10.0), rows_per_part=ROWS_PER_PART)


@contextlib.contextmanager
def _uninterrupted(*, fifo: bool) -> Iterator[None]:
    """No collector pauses: what counts is simulated time."""
    assert not fifo
    yield
