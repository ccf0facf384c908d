"""Scenarios of the hostile station with real processes, and the checks of each."""

import contextlib
import signal
import socket
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

import can

from tests.campaigns.hostile.flood import Sent, flood, responds, silent_nodes
from tests.campaigns.hostile.frames import FAMILIES, NEVER_HARMLESS, OWN, HostileFrame, harmless
from tests.campaigns.hostile.processes import STOP_LIMIT_S, Process, Rig

OnSent = Callable[[int], object]
Traffic = "Sequence[tuple[int, bytes]]"
RESTARTED = 0x100
"""Class of the error frame that reports a restarted interface (linux/can/error.h)."""
LONGEST_BURST = 200
"""Most consecutive frames of one family."""
STILL_M = 1e-9
"""Largest motion of an axis at standstill: rounding."""
IN_MOTION_M_S, MOTION_LIMIT_S = 0.02, 60.0
"""Speed from which the table is in motion, and the longest wait for it."""
MOST_GROWTH_MB = 100.0
"""Largest growth of a process's memory during a flood; chosen."""
PROGRAM = """
[[step]]
kind = "circle"
label = "round"
radius_mm = 5.0
feed_mm_min = 3000.0
turns = 1000.0
"""


class Result(NamedTuple):
    """Result of one scenario."""

    name: str
    sent: Sent
    problems: tuple[str, ...]
    figures: dict[str, Any]


def mixed(seed: int, traffic: Traffic, *, only_harmless: bool) -> Iterator[HostileFrame]:
    """Yield bursts of random families."""
    rng = Random(seed)
    names = [name for name in FAMILIES if not (only_harmless and name in NEVER_HARMLESS)]
    sources = [FAMILIES[name](Random(rng.getrandbits(32)), traffic) for name in names]
    while True:
        source = rng.choice(sources)
        for _ in range(rng.randrange(1, LONGEST_BURST)):
            frame = next(source)
            if not only_harmless or harmless(frame):
                yield frame


def standing_by(rig: Rig, traffic: Traffic, count: int, seed: int, on_sent: OnSent) -> Result:
    """Send frames that no node must obey to a machine in standby: nothing moves, and the controller stays."""
    controller = rig.controller()
    controller.await_line("stage STANDBY")
    rig.truth()
    before = _memory(rig, controller)
    problems: list[str] = []
    with contextlib.closing(_Station(rig)) as station:
        sent = flood(station.bus, mixed(seed, traffic, only_harmless=True), count, on_sent)
        if not controller.alive:
            problems.append("the controller has ended")
        elif not responds(station.bus, OWN):
            problems.append("the controller does not answer any more")
    truth, after = rig.truth(), _memory(rig, controller)
    if truth["moved_m"] > STILL_M or truth["powered"]:
        problems.append(f"something moved: {truth}")
    problems += _memory_problems(before, after)
    problems += _ended(controller, may_fail=True)
    return Result(
        "standing by", sent, tuple(problems), {"memory_mb": after, **_in_mm(truth), **controller.last_json()}
    )


def everything(rig: Rig, traffic: Traffic, count: int, seed: int, on_sent: OnSent) -> Result:
    """Send frames of all families: the controller stops and ends, and the simulator keeps running."""
    controller = rig.controller()
    controller.await_line("stage STANDBY")
    rig.truth()
    before = _memory(rig, None)
    with contextlib.closing(_Station(rig)) as station:
        sent = flood(station.bus, mixed(seed, traffic, only_harmless=False), count, on_sent)
        problems = _ends_by_itself(controller)
        problems += _silent(station)
    truth, after = rig.truth(), _memory(rig, None)
    if not truth["finite"]:
        problems.append(f"the plant is not a number: {truth}")
    problems += _memory_problems(before, after)
    return Result(
        "everything", sent, tuple(problems), {"memory_mb": after, **_in_mm(truth), **controller.last_json()}
    )


def moving(rig: Rig, traffic: Traffic, count: int, seed: int, on_sent: OnSent) -> Result:
    """Send frames of all families while the table runs a circle: the controller ends with a reason."""
    program = rig.machine / "hostile.toml"
    program.write_text(PROGRAM, encoding="utf-8")
    controller = rig.controller(str(program))
    controller.await_line("stage RUNNING")
    started = _await_motion(rig, controller)
    with contextlib.closing(_Station(rig)) as station:
        sent = flood(station.bus, mixed(seed, traffic, only_harmless=False), count, on_sent)
        problems = started + _ends_by_itself(controller) + _silent(station)
    truth = rig.truth()
    if not truth["finite"]:
        problems.append(f"the plant is not a number: {truth}")
    if not controller.last_json().get("reason"):
        problems.append("the controller does not say why it ended")
    return Result("moving", sent, tuple(problems), {**_in_mm(truth), **controller.last_json()})


def malformed_packets(rig: Rig, count: int, seed: int, path: Path) -> Result:
    """Connect clients that send no CAN frames or disconnect early: the hub cuts off these alone."""
    rng, begun_s, problems = Random(seed), time.monotonic(), []
    for _ in range(count):
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as client, contextlib.suppress(OSError):
            client.connect(str(path))  # waits for its turn in the hub's connection queue
            client.settimeout(5.0)
            if rng.random() < 0.7:
                client.send(rng.choice((b"a", b"o")))
            for _ in range(rng.randrange(4)):
                client.send(rng.randbytes(rng.choice((0, 1, 15, 16, 17, 64, 4096))))
    with contextlib.closing(_Station(rig)) as station:
        station.restart_the_bus()
        problems = _silent(station)
    return Result("malformed packets", Sent(count, 0, time.monotonic() - begun_s), tuple(problems), {})


def _await_motion(rig: Rig, controller: Process) -> list[str]:
    """Wait until an axis moves, by the simulator's truth; return the problem if it does not."""
    deadline_s = time.monotonic() + MOTION_LIMIT_S
    rig.truth()  # discard the motion before
    while rig.truth()["fastest_m_s"] < IN_MOTION_M_S:
        if not controller.alive or time.monotonic() > deadline_s:
            controller.end()
            return [f"the table does not move: {controller.lines[-5:]}"]
    return []


class _Station:
    """A hostile station that closes its bus."""

    def __init__(self, rig: Rig) -> None:
        self.bus = rig.station()

    def restart_the_bus(self) -> None:
        """Undo a bus-off that random bytes reported: clients of the hub may send error frames."""
        self.bus.send(can.Message(arbitration_id=RESTARTED, is_error_frame=True, data=bytes(8)))

    def close(self) -> None:
        self.bus.shutdown()


def _silent(station: _Station) -> list[str]:
    return [f"node {node} does not answer any more" for node in silent_nodes(station.bus)]


def _in_mm(truth: dict[str, Any]) -> dict[str, Any]:
    return {
        "moved_mm": 1e3 * truth["moved_m"],
        "furthest_mm": 1e3 * truth["furthest_m"],
        "fastest_mm_s": 1e3 * truth["fastest_m_s"],
        "powered": truth["powered"],
        "advances": truth["advances"],
    }


def _memory(rig: Rig, controller: Process | None) -> dict[str, float]:
    memory_mb = {"simulator": rig.simulator.memory_mb}
    if rig.hub is not None:
        memory_mb["hub"] = rig.hub.memory_mb
    if controller is not None:
        memory_mb["controller"] = controller.memory_mb
    return memory_mb


def _memory_problems(before: dict[str, float], after: dict[str, float]) -> list[str]:
    grown = [name for name in before if after[name] > before[name] + MOST_GROWTH_MB]
    return [f"{name} needs {after[name]:.0f} MB after {before[name]:.0f}" for name in grown]


def _ends_by_itself(controller: Process) -> list[str]:
    """Check that the controller ends beside a duplicate master, with the exit status of a failure."""
    deadline_s = time.monotonic() + STOP_LIMIT_S
    while controller.alive and time.monotonic() < deadline_s:
        time.sleep(0.1)
    problems = ["the controller goes on beside another one"] if controller.alive else []
    return problems + _ended(controller, may_fail=True)


def _ended(controller: Process, *, may_fail: bool) -> list[str]:
    status = controller.end()
    problems = [controller.traceback] if controller.traceback else []
    if status is None:
        problems.append("the controller had to be killed")
    elif status == -signal.SIGTERM or status < 0 or (status and not may_fail):
        problems.append(f"the controller ended with {status}: {controller.lines[-5:]}")
    return problems
