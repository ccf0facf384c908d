"""Runs daemon and simulator in simulated time on a bus with a hostile station."""

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

MASTER_FRAMES = OF_A_CONTROLLER - {NMT}
"""Identifiers that prove a duplicate master; an NMT command may be a configuration tool's."""
WATCHED_TICKS = 260
"""Ticks from the start of an attack to the end of its run."""
NO_FAULT = Fault("hostile", lambda _scene: None)


class Attack(NamedTuple):
    """Parameters of one attack, drawn before its run."""

    seed: int
    family: str
    state: str
    pacing: str
    stand_by: bool
    frames: int
    only_harmless: bool
    """Without the frames that a node must obey."""


class Outcome(NamedTuple):
    """Results of the run of an attack."""

    attack: Attack
    sent: int
    answers: int
    """Frames that the nodes and the controller sent after the first hostile one."""
    first_row: int | None
    """Row of the truth at which the attack began; None if it did not."""
    truth: Truth
    report: RunReport | None
    error: str
    stuck: str
    first_forged: int | None
    """Cycle of the first forged frame that only a controller may send."""
    stages: list[tuple[int, int]]


class Inbox:
    """The bus that the simulator's port reads, with the frames of the hostile station."""

    channel_info = "hostile"

    def __init__(self) -> None:
        self.waiting: list[can.Message] = []

    def recv(self, _timeout: float) -> can.Message | None:
        return self.waiting.pop(0) if self.waiting else None


class Station:
    """Sends frames to the ports of controller and simulator, as a bus would."""

    def __init__(self, stand: Stand) -> None:
        self._stand = stand
        self._inbox = Inbox()
        bus: Any = self._inbox
        self._port = SimulatorPort(bus)
        self._port.on_overrun = stand.bench.on_overrun

    def send(self, frame: HostileFrame) -> None:
        """Send one frame to both ports."""
        wire, message = self._stand.wire, frame.message()
        message.timestamp = self._stand.loop.time()
        if wire.controller_port.fileno() >= 0 and not wire.controller_dead:
            wire.controller_port._received.append(message)
            wire.controller_port.wake()
        wire.after_frame(functools.partial(self._to_nodes, message))

    def _to_nodes(self, message: can.Message) -> None:
        self._inbox.waiting.append(message)
        self._port.drain(self._stand.wire.nodes)


def run_attack(attack: Attack, machine: CampaignMachine, folder: Path) -> Outcome:
    """Run the attack in the empty `folder`; after WATCHED_TICKS the run ends as by a signal."""
    rng = Random(attack.seed)
    with parsed_files_cached():
        stand = Stand(machine, folder, attack.pacing)
    station = Station(stand)
    source = _source(attack, rng)
    sent, first_row, first_forged, frames_before = 0, None, None, 0
    operator_acts: Callable[[], None] = stand.wire.on_zero  # until the attack begins

    def burst() -> None:
        """Send a random number of frames between two ticks."""
        nonlocal sent, first_forged
        operator_acts()
        for _ in range(min(rng.choice((0, 1, 3, 10, 40)), attack.frames - sent)):
            frame = next(source)
            if first_forged is None and not harmless(frame) and frame.can_id in MASTER_FRAMES:
                first_forged = stand.wire.cycle
            station.send(frame)
            sent += 1

    def begin() -> None:
        nonlocal first_row, frames_before, operator_acts
        first_row, frames_before = len(stand.truth_recorder._rows), len(stand.wire.frames)
        operator_acts = stand.on_tick
        stand.on_tick = burst

    Operator(stand, rng, attack.state, begin, WATCHED_TICKS, stand_by=attack.stand_by)
    plan = Plan(attack.seed, NO_FAULT, attack.state, attack.pacing, attack.stand_by)
    with parsed_files_cached():
        ending = daemon_run.run_daemon(stand, daemon_run.faulty_run(plan, stand))
    for _ in range(attack.frames - sent):  # after the end of the controller, for the simulator alone
        station.send(next(source))
        sent += 1
    stand.advance_nodes(0.05)
    report, error, stuck = ending
    return Outcome(
        attack=attack,
        sent=sent,
        answers=len(stand.wire.frames) - frames_before,
        first_row=first_row,
        truth=stand.truth_recorder.truth(),
        report=report,
        error=error,
        stuck=stuck,
        first_forged=first_forged,
        stages=stand.stages,
    )


def _source(attack: Attack, rng: Random) -> Iterator[HostileFrame]:
    frames = FAMILIES[attack.family](rng, legitimate_traffic())
    return (frame for frame in frames if harmless(frame)) if attack.only_harmless else frames


@functools.cache
def legitimate_traffic() -> tuple[tuple[int, bytes], ...]:
    """Return the frames of a run without attack: boot, homing, a program and the end."""
    import tempfile  # noqa: PLC0415

    with tempfile.TemporaryDirectory(prefix="hostile-") as place:
        folder = Path(place)
        stand = Stand(make_machine(folder), folder, "lockstep")
        Operator(stand, Random(0), "running", lambda: None, WATCHED_TICKS, stand_by=False)
        plan = Plan(0, NO_FAULT, "running", "lockstep", stand_by=False)
        with parsed_files_cached():
            daemon_run.run_daemon(stand, daemon_run.faulty_run(plan, stand))
        return tuple((frame.can_id, frame.data) for frame in stand.wire.frames)
