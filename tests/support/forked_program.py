"""Programs of the project that are forked from one process that has loaded them (`program_template.py`)."""

import atexit
import contextlib
import functools
import os
import select
import shlex
import signal
import socket
import struct
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

HERE = Path(__file__).parent
PYTHON = sys.executable
HIL_SIM, SERVO_CTRL, HUB = ("hil-sim",), ("servo-ctrl",), ("python3", "-m", "local_can")
PACED_HUB = ("python3", "-m", "tests.support.paced_hub")
"""Beginnings of command lines."""
START_LIMIT_S = 300.0
"""The template loads, and on a new machine compiles, before it forks."""
NO_THREADS = {
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "JE_ARROW_MALLOC_CONF": "background_thread:false",
}
"""Of the template, whose forks lack all threads but one."""
NAMES = ("python3", "servo-ctrl", "hil-sim", "reconcile")
COMMAND = '#!/bin/sh\nexec {python} -IS {launcher} {address} {name} "$@"\n'


class ForkedProgram:
    """A running program with the interface of `subprocess.Popen`; `stdout` carries both outputs."""

    def __init__(self, command: Sequence[str | Path], log: int | None = None) -> None:
        """Start it; both outputs go to the descriptor `log`, or to a pipe."""
        read, write = os.pipe() if log is None else (None, log)
        self.stdout = None if read is None else os.fdopen(read, "rb")
        program, *arguments = map(str, command)
        request = (program, arguments, str(Path.cwd()), outside_pytest())
        self._answer = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._answer.connect(str(commands_folder() / "template"))
        with Path(os.devnull).open("rb") as nothing:
            streams = [nothing.fileno(), write, write]
            socket.send_fds(self._answer, [repr(request).encode()], streams)
        if read is not None:
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
        return int(struct.unpack("<i", self._answer.recv(4))[0])


def outside_pytest() -> dict[str, str]:
    """Return the environment that a user would have: NiceGUI, for one, is different under pytest."""
    return {name: text for name, text in os.environ.items() if not name.startswith("PYTEST_")}


@contextlib.contextmanager
def programs_forked() -> Iterator[None]:
    """Within the block, Python and the commands beside it are forks: also those that the product starts."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "executable", str(commands_folder() / "python3"))
        yield


@functools.cache
def commands_folder() -> Path:
    """Return a folder with the commands of a user, which a template forks; start the template.

    Whoever forks workers calls it before: they share the template, which ends with the last of them.
    """
    place = tempfile.TemporaryDirectory(prefix="forks-")
    folder = Path(place.name)
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    listener.bind(str(folder / "template"))
    listener.listen(64)
    words = {
        "python": sys.executable,
        "launcher": HERE / "forking_command.py",
        "address": folder / "template",
    }
    quoted = {word: shlex.quote(str(value)) for word, value in words.items()}
    for name in NAMES:
        (folder / name).write_text(COMMAND.format(name=name, **quoted), encoding="utf-8")
        (folder / name).chmod(0o755)
    life, end_of_life = os.pipe()
    numbers = [str(listener.fileno()), str(life), str(folder)]
    template = subprocess.Popen(
        [PYTHON, str(HERE / "program_template.py"), *numbers],
        pass_fds=[listener.fileno(), life],
        env=outside_pytest() | NO_THREADS,
        start_new_session=True,  # Ctrl-C is for the tests, which end their programs
    )
    listener.close()
    os.close(life)
    owner = os.getpid()

    def end() -> None:
        if os.getpid() == owner:
            os.close(end_of_life)
            template.wait()
            place.cleanup()

    atexit.register(end)
    return folder
