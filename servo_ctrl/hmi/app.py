"""The page's process: routes, and the start of the library that serves them."""

from __future__ import annotations

import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from nicegui import app, background_tasks, ui
from starlette.requests import Request  # noqa: TC002  # FastAPI reads the annotation
from starlette.responses import JSONResponse

from servo_ctrl.config.local_messages import Who
from servo_ctrl.hmi.bench import QUICK_STOP, Bench, Visitor
from servo_ctrl.hmi.frame import build_page
from servo_ctrl.hmi.guard import SESSION_COOKIE, Guard
from servo_ctrl.hmi.login import add_login
from servo_ctrl.hmi.marks import show_marks
from servo_ctrl.hmi.pages import PAGES, contour
from servo_ctrl.hmi.palette import BLUE, GREEN, VERMILION
from servo_ctrl.hmi.preferences import DARK_COOKIE, UNITS_COOKIE, remembered
from servo_ctrl.hmi.units import system_of

if TYPE_CHECKING:
    from types import ModuleType

    from servo_ctrl.hmi.access import Entry

STATIC = Path(__file__).parent / "static"
STATIC_ADDRESS = "/bench"
RECONNECT_S = 15.0
"""So long a browser may be away before its page is built anew."""


class Listening(NamedTuple):
    """Where browsers come to."""

    host: str
    port: int
    certificate: Path | None = None
    key: Path | None = None

    @property
    def address(self) -> str:
        """As it is typed into a browser."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{'https' if self.certificate else 'http'}://{host}:{self.port}"


def serve(bench: Bench, listening: Listening) -> None:
    """Serve until the process is told to end."""
    show_marks()
    add_pages(bench)
    add_stop(bench)
    add_login(app, bench.access, bench.sessions)
    app.add_middleware(Guard, access=bench.access, sessions=bench.sessions)
    app.add_static_files(STATIC_ADDRESS, STATIC)
    app.colors(primary=BLUE, positive=GREEN, negative=VERMILION)
    app.on_startup(lambda: background_tasks.create(bench.link.run(), name="link to the machine"))
    files = {"ssl_certfile": listening.certificate, "ssl_keyfile": listening.key}
    tls: dict[str, Any] = {name: str(path) for name, path in files.items() if path is not None}
    ui.run(
        host=listening.host,
        port=listening.port,
        title="Operator's bench",
        language="en-GB",
        reload=False,
        show=False,
        tailwind=False,
        reconnect_timeout=RECONNECT_S,
        show_welcome_message=False,
        server_header=False,
        proxy_headers=False,  # an address is what connects, not what somebody says it is
        ws_per_message_deflate=False,  # thirty pictures a second: packing costs more than it saves here
        **tls,
    )


def add_pages(bench: Bench) -> None:
    """A route for every page."""
    ui.add_head_html(
        f'<link rel="stylesheet" href="{STATIC_ADDRESS}/bench.css">'
        f'<script src="{STATIC_ADDRESS}/bench.js"></script>',
        shared=True,
    )
    titles = {path: page.TITLE for path, page in PAGES.items()}
    for path, page in PAGES.items():
        _add_page(bench, path, page, titles)
    contour.begin(bench)


def _add_page(bench: Bench, path: str, page: ModuleType, titles: dict[str, str]) -> None:
    @ui.page(path, title=f"{page.TITLE} \N{EM DASH} operator's bench")
    def show(request: Request) -> None:
        visitor = visitor_of(request)
        client = ui.context.client
        control = bench.control
        went = partial(_page_went, bench, visitor.browser, client.id)
        # not only from its connection on: a slow browser takes longer from page to page than the grace
        control.page_came(visitor.browser, client.id)
        client.on_connect(lambda: control.page_came(visitor.browser, client.id))
        client.on_disconnect(went)
        client.on_delete(went)
        build_page(bench, visitor, path, titles, page.build)


def _page_went(bench: Bench, browser: str, page: str) -> None:
    bench.control.page_went(browser, page, time.monotonic())


def visitor_of(request: Request) -> Visitor:
    """Who has asked for this page; the guard has let them in."""
    entry, browser = _who_of(request)
    return Visitor(
        user=entry.name,
        role=entry.role,
        address=request.client.host if request.client else "",
        browser=browser,
        session=request.cookies.get(SESSION_COOKIE, ""),
        units=system_of(remembered(request, UNITS_COOKIE)),
        dark=remembered(request, DARK_COOKIE) == "1",
    )


def _who_of(request: Request) -> tuple[Entry, str]:
    entry, browser = request.scope["bench"]
    return entry, browser


def add_stop(bench: Bench) -> None:
    """STOP has a route of its own: whoever may see the page may stop the machine."""

    @app.post("/stop")
    async def stop(request: Request) -> JSONResponse:
        entry, _ = _who_of(request)
        address = request.client.host if request.client else ""
        who = Who(user=entry.name, role=entry.role.word, address=address[:64])
        answer = await bench.link.request(who, "command", command=QUICK_STOP)
        return JSONResponse({"accepted": answer.accepted, "reason": answer.reason})
