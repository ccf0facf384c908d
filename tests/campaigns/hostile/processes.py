"""Hub, simulator and controller as processes, for the hostile station; every wait is bounded."""

import contextlib
import json
import queue
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import can

ROOT = Path(__file__).parents[3]
START_LIMIT_S, STOP_LIMIT_S = 240.0, 60.0
MOST_LOSS_LINES = 100
"""Bounds the lines after which messages about lost frames are no longer kept."""


class Process:
    """A child process whose printed lines are kept."""

    def __init__(self, *arguments: str) -> None:
        command = [sys.executable, "-m", *arguments]
        self._child = subprocess.Popen(
            command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, bufsize=1
        )
        self.lines: list[str] = []
        self._arriving: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def alive(self) -> bool:
        """Whether it has not ended."""
        return self._child.poll() is None

    @property
    def memory_mb(self) -> float:
        """Resident memory in MB; 0 when it has ended."""
        with contextlib.suppress(OSError):
            for line in Path(f"/proc/{self._child.pid}/status").read_text(encoding="ascii").splitlines():
                if line.startswith("VmRSS"):
                    return int(line.split()[1]) / 1024.0
        return 0.0

    def await_line(self, text: str, limit_s: float = START_LIMIT_S) -> str:
        """Return the next line with this text. Raises TimeoutError, also if the process ends without it."""
        deadline_s = time.monotonic() + limit_s
        with contextlib.suppress(queue.Empty):
            while line := self._arriving.get(timeout=max(0.0, deadline_s - time.monotonic())):
                self._keep(line)
                if text in line:
                    return line
        raise TimeoutError(f"no {text!r} in time; its output: {self.lines[-10:]}")

    def signal(self, number: signal.Signals) -> None:
        """Send a signal to the child alone."""
        if self.alive:
            self._child.send_signal(number)

    def end(self, limit_s: float = STOP_LIMIT_S) -> int | None:
        """End it by SIGTERM; return its status, None if it had to be killed."""
        self.signal(signal.SIGTERM)
        status: int | None = None
        try:
            status = self._child.wait(limit_s)
        except subprocess.TimeoutExpired:
            self._child.kill()
            self._child.wait(limit_s)
        self._reader.join(limit_s)
        while not self._arriving.empty():
            self._keep(self._arriving.get())
        return status

    def _read(self) -> None:
        """Read lines in a thread, with "" after the last one."""
        stdout = self._child.stdout
        assert stdout is not None
        with stdout:
            for line in stdout:
                self._arriving.put(line.rstrip("\n") or " ")
        self._arriving.put("")

    def _keep(self, line: str) -> None:
        """Keep a line; forged error frames may cause many messages about lost frames."""
        if "frames lost" not in line or len(self.lines) < MOST_LOSS_LINES:
            self.lines.append(line)

    def last_json(self) -> dict[str, Any]:
        """Return the newest line of JSON; empty if there is none."""
        found: dict[str, Any] = next(
            (json.loads(line) for line in reversed(self.lines) if line.startswith("{")), {}
        )
        return found

    @property
    def traceback(self) -> str:
        """The first traceback that it printed; empty without one."""
        text = "\n".join(self.lines)
        return text[text.index("Traceback") :][:2000] if "Traceback" in text else ""


class Rig:
    """A bus and the simulator on it; `bus` is INTERFACE:CHANNEL, None starts a hub in `folder`."""

    def __init__(self, folder: Path, machine: Path, bus: str | None = None) -> None:
        self.machine = machine
        self.hub: Process | None = None
        if bus is None:
            socket = folder / "hostile.sock"
            self.hub = Process("local_can", str(socket))
            self.hub.await_line("bus at")
            bus = f"localcan:{socket}"
        self.bus = bus
        self.simulator = Process("tests.campaigns.hostile.simulator", str(machine), bus)
        self.simulator.await_line("on the bus")

    def station(self) -> can.BusABC:
        """Open the bus for the hostile station."""
        interface, _, channel = self.bus.partition(":")
        return can.Bus(interface=interface, channel=channel, receive_own_messages=False)

    def controller(self, what: str = "standby") -> Process:
        """Start a controller on the bus: in standby, or with a program."""
        return Process("tests.campaigns.hostile.controller", str(self.machine), self.bus, what)

    def truth(self) -> dict[str, Any]:
        """Return the simulator's true motion since the last call (`simulator.TruthWindow`)."""
        self.simulator.signal(signal.SIGUSR1)
        found: dict[str, Any] = json.loads(self.simulator.await_line('"moved_m"', STOP_LIMIT_S))
        return found

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, _kind: type[BaseException] | None, _error: BaseException | None, _trace: TracebackType | None
    ) -> None:
        self.simulator.end()
        if self.hub is not None:
            self.hub.end()
