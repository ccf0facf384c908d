"""A hostile station at a run of the campaign's stand: daemon and simulator as they are, in simulated time."""

import functools
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

import can

from hil_sim.runner.can_port import CanPort as SimulatorPort
from servo_ctrl.daemon.run.report import RunReport
from tests.campaigns.campaign import daemon_run
from tests.campaigns.campaign.draw import Plan
from tests.campaigns.campaign.fault_context import Fault
from tests.campaigns.campaign.machine import CampaignMachine, make_machine, parsed_files_cached
from tests.campaigns.campaign.script import Operator
from tests.campaigns.campaign.stand import Stand
from tests.campaigns.campaign.truth import Truth
from tests.campaigns.hostile.frames import FAMILIES, NMT, OF_A_CONTROLLER, HostileFrame, harmless

CONTROLLERS_ALONE = OF_A_CONTROLLER - {NMT}
"""An NMT command may be a configuration tool's."""
WATCHED = 260
"""Ticks between the beginning of an attack and the end of its run."""
NO_FAULT = Fault("hostile", lambda _scene: None)


class Attack(NamedTuple):
    """What is drawn before the run begins."""

    seed: int
    family: str
    state: str
    pacing: str
    stand_by: bool
    frames: int
    only_harmless: bool
    """Frames that a node has to obey are left out."""


class Outcome(NamedTuple):
    """What is left of it."""

    attack: Attack
    sent: int
    answers: int
    """Frames that the nodes and the controller sent after the first hostile one."""
    begun: int | None
    """Place among the rows of the truth where it began."""
    truth: Truth
    report: RunReport | None
    error: str
    stuck: str
    first_forged: int | None
    """Cycle in which the first frame came that only a controller may send."""
    stages: list[tuple[int, int]]


class Inbox:
    """What the simulator's own port reads from."""

    channel_info = "hostile"

    def __init__(self) -> None:
        self.waiting: list[can.Message] = []

    def recv(self, _timeout: float) -> can.Message | None:
        return self.waiting.pop(0) if self.waiting else None


class Station:
    """Says a frame to the controller's port and to the simulator's, as the bus would."""

    def __init__(self, stand: Stand) -> None:
        self._stand = stand
        self._inbox = Inbox()
        bus: Any = self._inbox
        self._port = SimulatorPort(bus)
        self._port.on_overrun = stand.bench.on_overrun

    def say(self, frame: HostileFrame) -> None:
        """To both."""
        wire, message = self._stand.wire, frame.message()
        message.timestamp = self._stand.loop.time()
        if wire.controller_port.fileno() >= 0 and not wire.controller_dead:
            wire.controller_port._received.append(message)
            wire.controller_port.wake()
        wire.after_frame(functools.partial(self._to_nodes, message))

    def _to_nodes(self, message: can.Message) -> None:
        self._inbox.waiting.append(message)
        self._port.drain(self._stand.wire.nodes)


def attacked(attack: Attack, machine: CampaignMachine, folder: Path) -> Outcome:
    """Make the run in this folder, which is empty. After its last frame the run is ended as by a signal."""
    rng = Random(attack.seed)
    with parsed_files_cached():
        stand = Stand(machine, folder, attack.pacing)
    station = Station(stand)
    source = _source(attack, rng)
    sent, begun, forged, before = 0, None, None, 0
    operator_acts: Callable[[], None] = stand.wire.on_zero  # nothing yet

    def burst() -> None:
        """Between two ticks, and now and then between two frames of the cycle."""
        nonlocal sent, forged
        operator_acts()
        for _ in range(min(rng.choice((0, 1, 3, 10, 40)), attack.frames - sent)):
            frame = next(source)
            if forged is None and not harmless(frame) and frame.can_id in CONTROLLERS_ALONE:
                forged = stand.wire.cycle
            station.say(frame)
            sent += 1

    def begin() -> None:
        nonlocal begun, before, operator_acts
        begun, before = len(stand.truth_recorder._rows), len(stand.wire.frames)
        operator_acts = stand.on_tick
        stand.on_tick = burst

    Operator(stand, rng, attack.state, begin, WATCHED, stand_by=attack.stand_by)
    plan = Plan(attack.seed, NO_FAULT, attack.state, attack.pacing, attack.stand_by)
    with parsed_files_cached():
        ending = daemon_run.run_daemon(stand, daemon_run.faulty_run(plan, stand))
    for _ in range(attack.frames - sent):  # the controller has gone; the simulator gets the rest
        station.say(next(source))
        sent += 1
    stand.advance_nodes(0.05)
    return Outcome(
        attack,
        sent,
        len(stand.wire.frames) - before,
        begun,
        stand.truth_recorder.truth(),
        *ending,
        forged,
        stand.stages,
    )


def _source(attack: Attack, rng: Random) -> Iterator[HostileFrame]:
    frames = FAMILIES[attack.family](rng, recorded())
    return (frame for frame in frames if harmless(frame)) if attack.only_harmless else frames


@functools.cache
def recorded() -> tuple[tuple[int, bytes], ...]:
    """Legitimate traffic: boot, homing, a program and the end of a run, as they were on the wire."""
    import tempfile  # noqa: PLC0415

    with tempfile.TemporaryDirectory(prefix="hostile-") as place:
        folder = Path(place)
        stand = Stand(make_machine(folder), folder, "lockstep")
        Operator(stand, Random(0), "running", lambda: None, WATCHED, stand_by=False)
        plan = Plan(0, NO_FAULT, "running", "lockstep", stand_by=False)
        with parsed_files_cached():
            daemon_run.run_daemon(stand, daemon_run.faulty_run(plan, stand))
        return tuple((frame.can_id, frame.data) for frame in stand.wire.frames)
