"""Programs of the project that are forked from one process that has loaded them (`program_template.py`)."""

import atexit
import functools
import json
import os
import select
import signal
import socket
import struct
import subprocess
import sys
from pathlib import Path

TEMPLATE = Path(__file__).with_name("program_template.py")
HIL_SIM, HUB = "hil_sim.cli.main:main", "local_can.__main__:main"
START_LIMIT_S = 300.0
"""The template loads, and on a new machine compiles, before it forks."""


class ForkedProgram:
    """A running program with the interface of `subprocess.Popen`; `stdout` carries both outputs."""

    def __init__(self, program: str, arguments: list[str]) -> None:
        read, write = os.pipe()
        self.stdout = os.fdopen(read, "rb")
        self._answer, theirs = socket.socketpair()
        request = json.dumps({"program": program, "arguments": arguments}).encode()
        with theirs:
            socket.send_fds(_template(), [request], [write, theirs.fileno()])
        os.close(write)
        self.returncode: int | None = None
        self.pid = self._receive(START_LIMIT_S)

    def poll(self) -> int | None:
        """Return the exit status, None while the program runs."""
        if self.returncode is None and select.select([self._answer], [], [], 0.0)[0]:
            self.wait()
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        """Wait for the end, return the exit status. Raises subprocess.TimeoutExpired."""
        if self.returncode is None:
            self.returncode = self._receive(timeout)
            self._answer.close()
        return self.returncode

    def send_signal(self, number: int) -> None:
        """Send a signal, unless the program has ended."""
        if self.poll() is None:
            os.kill(self.pid, number)

    def terminate(self) -> None:
        """Send SIGTERM."""
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        """Send SIGKILL."""
        self.send_signal(signal.SIGKILL)

    def _receive(self, timeout_s: float | None) -> int:
        if not select.select([self._answer], [], [], timeout_s)[0]:
            raise subprocess.TimeoutExpired("a forked program", timeout_s or 0.0)
        return int(struct.unpack("<i", self._answer.recv(4, socket.MSG_WAITALL))[0])


@functools.cache
def _template() -> socket.socket:
    """Start the process that forks, one for each test process; it ends when the socket closes."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with theirs:
        command = [sys.executable, str(TEMPLATE), str(theirs.fileno())]
        template = subprocess.Popen(command, pass_fds=[theirs.fileno()])

    def end() -> None:
        ours.close()
        template.wait()

    atexit.register(end)
    return ours
