"""The simulator, which carries the embedded bus, as a real process; every wait is bounded."""

import contextlib
import os
import selectors
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import can
import pytest
from child_process import terminate
from consecutive_runs import ConsecutiveRuns
from forked_program import HIL_SIM, HUB, PACED_HUB, ForkedProgram, programs_forked
from machine_files import REPOSITORY, text_of, write_controller

from tests.campaigns.campaign.machine import make_machine

USER_COMMANDS = Path(sys.executable).parent
START_LIMIT_S = 240.0
STOP_LIMIT_S = 60.0
LAST_FRAME = (0x7FF, b"")
"""Loses every arbitration, so that the hub passes it on after all frames that wait."""


class BusMonitor:
    """Receives all frames in a thread, which may lag behind the lockstep, and sends its own."""

    def __init__(self, channel: str) -> None:
        self._channel = channel
        self.bus = can.Bus(interface="localcan", channel=channel)
        self.frames: list[tuple[int, bytes]] = []
        """(identifier, data) in order of the bus."""
        self._notifier = can.Notifier(self.bus, [self._receive], 0.02)

    def send(self, can_id: int, payload: bytes) -> None:
        self.bus.send(can.Message(arbitration_id=can_id, data=payload, is_extended_id=False))

    def wait_for(self, can_id: int, payload: bytes) -> None:
        """Wait until this frame was received; fails after `STOP_LIMIT_S`."""
        deadline_s = time.monotonic() + STOP_LIMIT_S
        while (can_id, payload) not in self.frames:
            assert time.monotonic() < deadline_s, f"{can_id:X}h {payload.hex()} was not sent"
            time.sleep(0.01)

    def close(self) -> None:
        """Receive what was sent until now, and leave the bus."""
        with can.Bus(interface="localcan", channel=self._channel) as last_sender:
            last_sender.send(can.Message(arbitration_id=LAST_FRAME[0], is_extended_id=False))
        self.wait_for(*LAST_FRAME)
        self.frames.remove(LAST_FRAME)
        self._notifier.stop(timeout=2.0)
        self.bus.shutdown()

    def _receive(self, message: can.Message) -> None:
        self.frames.append((message.arbitration_id, bytes(message.data)))


class Bench:
    """Simulators on a bus that the first of them carries, and monitors of its frames."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._socket = folder / "can.sock"
        self._running: list[ForkedProgram | subprocess.Popen[bytes]] = []
        self.bus_spec = f"localcan:{self._socket}"

    def serve_bus(self, period_us: int = 0) -> ForkedProgram:
        """Start a lone hub: for a bus that is there without a simulator, or outlives one.

        With a period, no SYNC is passed on before it is due: a fast computer ends a motion no sooner.
        """
        socket = str(self._socket)
        hub = self._start([*PACED_HUB, socket, str(period_us)] if period_us else [*HUB, socket])
        self._await_hub()
        return hub

    def simulate(self, machine: Path, pacing: str = "lockstep") -> ForkedProgram:
        """Start a simulator; return when its nodes are on the bus."""
        process = self._start([*HIL_SIM, *self._options(machine, pacing)])
        self._await_line(process, b"on the bus")
        return process

    def simulate_by_command(self, machine: Path, pacing: str = "lockstep") -> subprocess.Popen[bytes]:
        """Start a simulator by the command of a user."""
        process = self.run("hil-sim", *self._options(machine, pacing))
        self._await_line(process, b"on the bus")
        return process

    def run(self, program: str, *arguments: str) -> subprocess.Popen[bytes]:
        """Start a program by the command of a user; it ends with the bench."""
        command = [str(USER_COMMANDS / program), *arguments]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self._running.append(process)
        return process

    def _options(self, machine: Path, pacing: str) -> list[str]:
        return ["run", "--machine", str(machine), "--bus", self.bus_spec, "--pacing", pacing]

    def machine(self, replacements: dict[str, str], name: str = "xy_table") -> Path:
        """Copy a machine with texts of its controller.toml replaced (first occurrence each)."""
        source, copy = REPOSITORY / "machines" / name, self._folder / "machine"
        write_controller(copy, text_of(source / "controller.toml", replacements, occurrences=1))
        (copy / "plant.toml").write_text(text_of(source / "plant.toml"), encoding="utf-8")
        return copy

    @contextlib.contextmanager
    def monitor(self) -> Iterator[BusMonitor]:
        """Return another participant of the bus; after the block it has received every frame."""
        made = BusMonitor(str(self._socket))
        try:
            yield made
        finally:
            made.close()

    def close(self) -> None:
        for process in reversed(self._running):
            terminate(process, STOP_LIMIT_S)
            assert process.stdout is not None
            process.stdout.close()

    def _start(self, command: list[str]) -> ForkedProgram:
        process = ForkedProgram(command)
        self._running.append(process)
        return process

    def _await_hub(self) -> None:
        deadline_s = time.monotonic() + START_LIMIT_S
        while True:
            with contextlib.suppress(can.CanError):
                can.Bus(interface="localcan", channel=str(self._socket)).shutdown()
                return
            assert time.monotonic() < deadline_s, "the hub did not come up"
            time.sleep(0.02)

    @staticmethod
    def _await_line(process: ForkedProgram | subprocess.Popen[bytes], text: bytes) -> None:
        """Read until a line with `text`; fails when the process ends or is silent for too long."""
        assert process.stdout is not None
        deadline_s = time.monotonic() + START_LIMIT_S
        printed = b""
        with selectors.DefaultSelector() as selector:
            selector.register(process.stdout, selectors.EVENT_READ)
            while text not in printed:
                ready = selector.select(max(0.0, deadline_s - time.monotonic()))
                assert ready, f"it did not print {text!r} in time: {printed!r}"
                chunk = os.read(process.stdout.fileno(), 4096)
                assert chunk, f"it ended: {printed!r}"
                printed += chunk


@pytest.fixture(scope="module", autouse=True)
def _programs_are_forked() -> Iterator[None]:
    with programs_forked():
        yield


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    made = Bench(tmp_path)
    yield made
    made.close()


@pytest.fixture
def hub(bench: Bench) -> ForkedProgram:
    """A lone hub, which serves the bus of the bench."""
    return bench.serve_bus()


@pytest.fixture
def table(tmp_path: Path) -> Iterator[ConsecutiveRuns]:
    """Runs in simulated time, in this process."""
    made = ConsecutiveRuns(make_machine(tmp_path), tmp_path)
    yield made
    made.close()


@pytest.fixture
def xy_table() -> Path:
    return REPOSITORY / "machines" / "xy_table"
