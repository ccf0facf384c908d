"""Work for a fleet's cluster that is quicker than a diagnosis; workers import it by its name."""

import contextlib
import os
import signal
import time
from pathlib import Path
from typing import NamedTuple

import psutil

from reconcile.fleet.task import AxisResult, AxisTask


class StubTask(NamedTuple):
    """What a stub is to do."""

    name: str
    deeds: str = ""
    """Directory in which each execution leaves a file."""
    deaths: int = 0
    """So many executions kill their worker before they are done."""


def run(errand: StubTask) -> str:
    """Leave a trace, perhaps die, else answer."""
    times = len(list(Path(errand.deeds).glob(f"{errand.name}-*")))
    (Path(errand.deeds) / f"{errand.name}-{times}").touch()
    if times < errand.deaths:
        os.kill(os.getpid(), signal.SIGKILL)
    return errand.name.upper()


def fail(errand: StubTask) -> str:
    """An error of the work itself."""
    raise ValueError(errand.name)


def dawdle(_errand: StubTask) -> str:
    """Python that does not end, and holds every `Exception`."""
    while True:
        with contextlib.suppress(Exception):
            time.sleep(0.01)


def listening() -> list[str]:
    """The addresses at which this process takes connections."""
    sockets = psutil.Process().net_connections("tcp")
    return [socket.laddr.ip for socket in sockets if socket.status == psutil.CONN_LISTEN]


def row(task: AxisTask) -> AxisResult:
    """A row without a diagnosis, and a trace of having been asked."""
    from reconcile.fleet.rows import row_of_failure  # noqa: PLC0415  # the other stubs start sooner without
    from reconcile.fleet.task import AxisResult  # noqa: PLC0415

    with (Path(task.data.root.removeprefix("file://")) / "asked.txt").open("a", encoding="utf-8") as file:
        file.write("x")
    content = {**row_of_failure(task.data, task.key, "diagnosed", ""), "verdict": "consistent", "error": None}
    return AxisResult(content, {"verdict.json": b"{}", "model.toml": b""})
