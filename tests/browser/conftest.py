"""Chromium on the page, with a stub for a machine; no page may send a request to another host."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import urlsplit

import pytest
from browser_program import CHROMIUM
from free_port import free_tcp_port
from live_page import go
from page_server import OUTSIDE_PYTEST, ROOT, Server, Stub, started
from playwright.sync_api import Browser, BrowserContext, Page, ViewportSize, expect, sync_playwright

PICTURES = ROOT / "out" / "browser"
STUB_SERVER = ("-m", "tests.browser.stub_server")
LIMIT_MS = 90_000  # a busy computer is slow, which is not a failure
expect.set_options(timeout=LIMIT_MS)


@pytest.fixture(scope="session")
def environment() -> dict[str, str]:
    """Of a process that serves pages."""
    return OUTSIDE_PYTEST


@pytest.fixture(scope="session")
def free_port() -> Callable[[], int]:
    """Returns a free port."""
    return free_tcp_port


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
    port = free_tcp_port()
    arguments = [*STUB_SERVER, str(port), str(directory / "out")]
    with started(arguments, f"http://127.0.0.1:{port}", directory / "log") as server:
        yield server


@pytest.fixture
def serving(tmp_path: Path) -> Iterator[Callable[..., Server]]:
    """Start another server on a stub, over TLS: `serving(access, certificate, key)`."""
    with ExitStack() as stack:

        def start(*files: Path) -> Server:
            port = free_tcp_port()
            arguments = [*STUB_SERVER, port, tmp_path / "out", *files]
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
    context = chromium.new_context(reduced_motion="reduce", **options)
    context.set_default_timeout(LIMIT_MS)
    problems: list[str] = []
    home = urlsplit(url).netloc

    def check(request: Any) -> None:
        split = urlsplit(request.url)
        if split.scheme not in {"data", "blob"} and split.netloc != home:
            problems.append(request.url)

    context.on("request", check)
    context.on("console", lambda message: print(message.text))  # beside a test that fails
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
        go(page, url + path)
        return page

    yield open_page
    for page in context.pages:
        _clear_local_storage(context, page, url)
        page.close()
    context.clear_cookies()  # the next test is by somebody else
    found, problems[:] = problems[:], []
    assert not found


def _clear_local_storage(context: BrowserContext, page: Page, url: str) -> None:
    """Clear it from outside: a script in a page that loads itself again at this moment has nowhere to run."""
    session = context.new_cdp_session(page)
    session.send("Storage.clearDataForOrigin", {"origin": url, "storageTypes": "local_storage"})


@pytest.fixture
def stub(chromium: Browser, stub_server: Server) -> Iterator[Stub]:
    """The machine behind `visit`; ready, as it began, at the end of each test."""
    context = chromium.new_context()
    context.set_default_timeout(LIMIT_MS)
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
