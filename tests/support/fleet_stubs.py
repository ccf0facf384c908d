"""Tasks for a fleet's cluster that are faster than a diagnosis; workers import them by name."""

import contextlib
import os
import signal
import time
from pathlib import Path
from typing import NamedTuple

import psutil

from reconcile.fleet.task import AxisResult, AxisTask


class StubTask(NamedTuple):
    """A task of a stub."""

    name: str
    directory: str = ""
    """Directory in which each execution creates a file."""
    deaths: int = 0
    """Number of executions that kill their worker before they end."""


def run(task: StubTask) -> str:
    """Create the file of this execution; kill the worker or return the name in capitals."""
    times = len(list(Path(task.directory).glob(f"{task.name}-*")))
    (Path(task.directory) / f"{task.name}-{times}").touch()
    if times < task.deaths:
        os.kill(os.getpid(), signal.SIGKILL)
    return task.name.upper()


def fail(task: StubTask) -> str:
    """Raise an error of the task itself."""
    raise ValueError(task.name)


def never_end(_task: StubTask) -> str:
    """Run Python code that does not end and suppresses every `Exception`."""
    while True:
        with contextlib.suppress(Exception):
            time.sleep(0.01)


def listening() -> list[str]:
    """Return the addresses at which this process listens."""
    sockets = psutil.Process().net_connections("tcp")
    return [socket.laddr.ip for socket in sockets if socket.status == psutil.CONN_LISTEN]


def row(task: AxisTask) -> AxisResult:
    """Return a row without a diagnosis; append a character to calls.txt."""
    from reconcile.fleet.rows import row_of_failure  # noqa: PLC0415  # the other stubs start sooner without
    from reconcile.fleet.task import AxisResult  # noqa: PLC0415

    with (Path(task.data.root.removeprefix("file://")) / "calls.txt").open("a", encoding="utf-8") as file:
        file.write("x")
    content = {**row_of_failure(task.data, task.key, "diagnosed", ""), "verdict": "consistent", "error": None}
    return AxisResult(content, {"verdict.json": b"{}", "model.toml": b""})
