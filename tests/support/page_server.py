"""A process that serves the operator's pages on a stub, and the test's interface to the stub machine."""

import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from child_process import terminate
from forked_program import commands_folder, outside_pytest
from playwright.sync_api import BrowserContext

ROOT = Path(__file__).parents[2]
START_LIMIT_S = 240.0

AT_ONCE = {"Connection": "close"}
"""Header of a request without keep-alive: the server may close a kept connection as it is used again."""
OUTSIDE_PYTEST = outside_pytest() | {"OMP_NUM_THREADS": "1"}


class Server:
    """A page's process."""

    def __init__(self, process: subprocess.Popen[bytes], url: str, log: Path) -> None:
        self.process = process
        self.url = url
        self.log = log


class Stub:
    """The test's interface to the machine behind the page."""

    def __init__(self, url: str, context: BrowserContext) -> None:
        self._url = url
        self._context = context
        self._seen = len(self._requests())

    def requests(self) -> list[dict[str, Any]]:
        """Return the requests of the page since the test began, without those about the control right."""
        return [one for one in self._requests()[self._seen :] if not one["do"].endswith("_control")]

    def commands(self) -> list[str]:
        return [request["command"] for request in self.requests() if request["do"] == "command"]

    def wait(self, happened: Callable[[], bool], limit_s: float = 90.0) -> None:
        """Wait until the condition holds."""
        deadline_s = time.monotonic() + limit_s
        while not happened():
            assert time.monotonic() < deadline_s, self.requests()
            time.sleep(0.05)

    def status(self, **fields: Any) -> int:
        """Change the machine's status; return its cycle, which goes on through all tests of a session."""
        cycle: int = self._post("status", fields)
        return cycle

    def link(self, **fields: Any) -> None:
        """`connected`, `answers` by `do` or command, `hello` (fields of it), `reset`."""
        self._post("link", fields)

    def _requests(self) -> list[dict[str, Any]]:
        answer = self._context.request.get(f"{self._url}/stub/requests", headers=AT_ONCE)
        found: list[dict[str, Any]] = answer.json()
        return found

    def _post(self, route: str, fields: dict[str, Any]) -> Any:
        answer = self._context.request.post(
            f"{self._url}/stub/{route}", data=fields, headers={"Origin": self._url, **AT_ONCE}
        )
        assert answer.ok, answer.text()
        return answer.json()


@contextmanager
def started(arguments: list[str], url: str, log: Path) -> Iterator[Server]:
    """`python3` with these arguments, forked: a server, from when it answers until it is ended."""
    with log.open("wb") as output:
        command = [commands_folder() / "python3", *arguments]
        process = subprocess.Popen(command, cwd=ROOT, stdout=output, stderr=output, env=OUTSIDE_PYTEST)
        try:
            _await_port(process, url, log)
            yield Server(process, url, log)
        finally:
            terminate(process, 10.0)


def _await_port(process: subprocess.Popen[bytes], url: str, log: Path) -> None:
    split = urlsplit(url)
    deadline_s = time.monotonic() + START_LIMIT_S
    while True:
        try:
            socket.create_connection((split.hostname or "", split.port or 0), timeout=1.0).close()
        except OSError:
            assert process.poll() is None, log.read_text()
            assert time.monotonic() < deadline_s, log.read_text()
            time.sleep(0.1)
        else:
            return
