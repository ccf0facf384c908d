"""Chromium on the page, with a stub for a machine; no page may send a request to another host."""

import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import urlsplit

import pytest
from browser_program import CHROMIUM
from child_process import terminate
from playwright.sync_api import Browser, BrowserContext, Page, ViewportSize, expect, sync_playwright

ROOT = Path(__file__).parents[2]
PICTURES = ROOT / "out" / "browser"
START_LIMIT_S = 240.0
expect.set_options(timeout=20_000)  # a busy computer is slow, which is no failure


# NiceGUI behaves differently under pytest
OUTSIDE_PYTEST = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
OUTSIDE_PYTEST["OMP_NUM_THREADS"] = "1"


class Server:
    """A page's process."""

    def __init__(self, process: subprocess.Popen[bytes], url: str, log: Path) -> None:
        self.process = process
        self.url = url
        self.log = log


class Stub:
    """The machine behind the page, from the test's side."""

    def __init__(self, url: str, context: BrowserContext) -> None:
        self._url = url
        self._context = context
        self._seen = len(self._requests())

    def requests(self) -> list[dict[str, Any]]:
        """The requests of the page since the test began, without those about the control right."""
        return [one for one in self._requests()[self._seen :] if not one["do"].endswith("_control")]

    def commands(self) -> list[str]:
        return [request["command"] for request in self.requests() if request["do"] == "command"]

    def wait(self, happened: Callable[[], bool], limit_s: float = 10.0) -> None:
        """Wait until the condition holds."""
        deadline_s = time.monotonic() + limit_s
        while not happened():
            assert time.monotonic() < deadline_s, self.requests()
            time.sleep(0.05)

    def status(self, **fields: Any) -> None:
        """Change the machine's status."""
        self._post("status", fields)

    def link(self, **fields: Any) -> None:
        """`connected`, `answers` by `do` or command, `hello` (fields of it), `reset`."""
        self._post("link", fields)

    def _requests(self) -> list[dict[str, Any]]:
        found: list[dict[str, Any]] = self._context.request.get(f"{self._url}/stub/requests").json()
        return found

    def _post(self, route: str, fields: dict[str, Any]) -> None:
        answer = self._context.request.post(
            f"{self._url}/stub/{route}", data=fields, headers={"Origin": self._url}
        )
        assert answer.ok, answer.text()


def a_free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextmanager
def started(arguments: list[str], url: str, log: Path) -> Iterator[Server]:
    """A server process, from when it answers until it is ended."""
    with log.open("wb") as output:
        process = subprocess.Popen(
            [sys.executable, *arguments], cwd=ROOT, stdout=output, stderr=output, env=OUTSIDE_PYTEST
        )
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


@pytest.fixture(scope="session")
def environment() -> dict[str, str]:
    """Of a process that serves pages."""
    return OUTSIDE_PYTEST


@pytest.fixture(scope="session")
def free_port() -> Callable[[], int]:
    """Returns a free port."""
    return a_free_port


@pytest.fixture(scope="module")  # while playwright lives, no other loop runs in this process
def chromium() -> Iterator[Browser]:
    if CHROMIUM is None:
        pytest.skip("chromium is not installed")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=CHROMIUM, args=["--no-sandbox", "--disable-background-networking"]
        )
        yield browser
        browser.close()


@pytest.fixture(scope="session")
def stub_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    if CHROMIUM is None:
        pytest.skip("chromium is not installed")
    directory = tmp_path_factory.mktemp("stub_server")
    port = a_free_port()
    arguments = [str(ROOT / "tests/browser/stub_server.py"), str(port), str(directory / "out")]
    with started(arguments, f"http://127.0.0.1:{port}", directory / "log") as server:
        yield server


@pytest.fixture
def serving(tmp_path: Path) -> Iterator[Callable[..., Server]]:
    """Start another server on a stub, over TLS: `serving(access, certificate, key)`."""
    with ExitStack() as stack:

        def start(*files: Path) -> Server:
            port = a_free_port()
            arguments = [ROOT / "tests/browser/stub_server.py", port, tmp_path / "out", *files]
            url = f"https://127.0.0.1:{port}"
            return stack.enter_context(started([str(part) for part in arguments], url, tmp_path / "log"))

        yield start


class Watched(NamedTuple):
    """A browser of its own (Chromium's context), and what must not have happened in it."""

    context: BrowserContext
    problems: list[str]
    """Errors of scripts, and requests that left the host."""


@contextmanager
def _watched(chromium: Browser, url: str, **options: Any) -> Iterator[Watched]:
    context = chromium.new_context(**options)
    problems: list[str] = []
    home = urlsplit(url).netloc

    def check(request: Any) -> None:
        split = urlsplit(request.url)
        if split.scheme not in {"data", "blob"} and split.netloc != home:
            problems.append(request.url)

    context.on("request", check)
    context.on("weberror", lambda error: problems.append(str(error.error)))
    yield Watched(context, problems)
    context.close()
    assert not problems


def _size(width: int) -> ViewportSize:
    return {"width": width, "height": 860 if width > 700 else 780}


@pytest.fixture
def visiting(chromium: Browser) -> Iterator[Callable[..., BrowserContext]]:
    """Browsers of their own; at the end nothing has failed in them, and no request has left the host."""
    with ExitStack() as stack:

        def start(url: str, width: int = 1280, **options: Any) -> BrowserContext:
            return stack.enter_context(_watched(chromium, url, viewport=_size(width), **options)).context

        yield start


@pytest.fixture(scope="module")
def one_browser(chromium: Browser, stub_server: Server) -> Iterator[Watched]:
    """A browser for many tests, one after the other: what it has loaded and compiled it keeps."""
    with _watched(chromium, stub_server.url) as watched:
        yield watched


@pytest.fixture
def visit(
    visiting: Callable[..., BrowserContext], one_browser: Watched, stub_server: Server
) -> Iterator[Callable[..., Page]]:
    """Open pages on the stub: `visit("/motion", width=360, dark=True)`, or with `another=True` elsewhere."""
    context, problems = one_browser
    url = stub_server.url

    def open_page(path: str = "/", *, width: int = 1280, dark: bool = False, another: bool = False) -> Page:
        browser = visiting(url) if another else context
        browser.add_cookies([{"name": "bench_dark", "value": str(int(dark)), "url": url}])
        page = browser.new_page()
        page.set_viewport_size(_size(width))
        page.goto(url + path)
        page.wait_for_function("window.did_handshake === true")
        return page

    yield open_page
    for page in context.pages:
        page.evaluate("localStorage.clear(); sessionStorage.clear()")
        page.close()
    context.clear_cookies()  # the next test is by somebody else
    found, problems[:] = problems[:], []
    assert not found


@pytest.fixture
def stub(chromium: Browser, stub_server: Server) -> Iterator[Stub]:
    """The machine behind `visit`; ready, as it began, at the end of each test."""
    context = chromium.new_context()
    machine = Stub(stub_server.url, context)
    machine.link(reset=True)
    yield machine
    machine.link(reset=True)
    context.close()


@pytest.fixture
def picture() -> Callable[[Page, str], None]:
    """Keep a screenshot as an artefact: `picture(page, "drive")`."""

    def keep(page: Page, name: str) -> None:
        PICTURES.mkdir(parents=True, exist_ok=True)
        seen = page.viewport_size
        assert seen is not None
        # as high as the page is: else the foot would lie across the middle of the picture
        height = page.evaluate("document.documentElement.scrollHeight")
        page.set_viewport_size({"width": seen["width"], "height": max(height, seen["height"])})
        page.wait_for_timeout(300)  # plots fit themselves to it
        page.screenshot(path=PICTURES / f"{name}.png")
        page.set_viewport_size(seen)

    return keep
