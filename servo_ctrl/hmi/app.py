"""The page's process: adds the routes and starts NiceGUI, which serves them."""

import time
from copy import copy
from pathlib import Path
from types import ModuleType
from typing import Any, Literal
from weakref import WeakKeyDictionary

from nicegui import Client, app, background_tasks, ui
from starlette.requests import Request  # FastAPI reads the annotation
from starlette.responses import JSONResponse

from kernels.compiler_memory import release_compiler
from servo_ctrl.commands.command import Command
from servo_ctrl.hmi.access.guard import SESSION_COOKIE, Guard
from servo_ctrl.hmi.access.login import add_login
from servo_ctrl.hmi.bus import page as bus
from servo_ctrl.hmi.contour import page as contour
from servo_ctrl.hmi.diagnosis import page as diagnosis
from servo_ctrl.hmi.drive import page as drive
from servo_ctrl.hmi.friction import page as friction
from servo_ctrl.hmi.languages.controller_messages import controller_text
from servo_ctrl.hmi.languages.texts import ENGLISH, LANGUAGE_COOKIE, CurrentLanguage, chosen_language, tr
from servo_ctrl.hmi.motion import page as motion
from servo_ctrl.hmi.scope import page as scope
from servo_ctrl.hmi.shell.frame import DARK_COOKIE, UNITS_COOKIE, build_page
from servo_ctrl.hmi.shell.open_page import OpenPage, PageServices
from servo_ctrl.hmi.shell.parts import configure_elements, notify_unexpected
from servo_ctrl.hmi.shell.plots import BLUE, GREEN, VERMILION
from servo_ctrl.hmi.shell.units import unit_system
from servo_ctrl.hmi.tuning import page as tuning

PAGES: dict[str, ModuleType] = {
    "/": drive,
    "/motion": motion,
    "/scope": scope,
    "/contour": contour,
    "/friction": friction,
    "/reconcile": diagnosis,
    "/tuning": tuning,
    "/bus": bus,
}
"""By address, in the order of their links: modules with `TITLE` and `build(page)`."""
STATIC = Path(__file__).parent / "static"
STATIC_ADDRESS = "/bench"
QUASAR_LANGUAGES: dict[str, Literal["en-GB", "de-DE"]] = {"en": "en-GB", "de": "de-DE"}
"""Language codes of Quasar and of the attribute `lang`, by ours."""
_LANGUAGES: WeakKeyDictionary[Client, str] = WeakKeyDictionary()
"""The language of each open page."""
RECONNECT_S = 15.0
"""Bounds the time that a browser may be disconnected before its page is rebuilt, seconds; chosen."""


def serve(
    services: PageServices, host: str, port: int, certificate: Path | None = None, key: Path | None = None
) -> None:
    """Serve the pages until the process is signalled to end; with a certificate and its key, by TLS."""
    configure_elements()
    CurrentLanguage.find = staticmethod(_language_of_client)
    add_pages(services)
    release_compiler()  # the kernels of the pages are loaded
    add_stop(services)
    add_login(app, services.access, services.sessions, services.language)
    app.add_middleware(Guard, access=services.access, sessions=services.sessions)
    app.add_static_files(STATIC_ADDRESS, STATIC)
    app.colors(primary=BLUE, positive=GREEN, negative=VERMILION)
    app.on_startup(lambda: background_tasks.create(services.link.run(), name="link to the machine"))
    tls: dict[str, Any] = (
        {"ssl_certfile": str(certificate), "ssl_keyfile": str(key)} if certificate and key else {}
    )
    ui.run(
        host=host,
        port=port,
        language="en-GB",
        reload=False,
        show=False,
        tailwind=False,
        reconnect_timeout=RECONNECT_S,
        show_welcome_message=False,
        server_header=False,
        proxy_headers=False,  # the address of the connection counts, not one that a header claims
        ws_per_message_deflate=False,  # thirty pictures a second: compressing costs more than it saves
        **tls,
    )


def add_pages(services: PageServices) -> None:
    """Add a route for every page."""
    ui.add_head_html(
        f'<link rel="stylesheet" href="{STATIC_ADDRESS}/bench.css">'
        f'<script src="{STATIC_ADDRESS}/bench.js"></script>'
        f'<script src="{STATIC_ADDRESS}/lost_clicks.js"></script>',
        shared=True,
    )
    titles = {path: module.TITLE for path, module in PAGES.items()}
    for path, module in PAGES.items():
        _add_page(services, path, module, titles)
    contour.prepare(services)
    friction.prepare(services)


def _add_page(services: PageServices, path: str, module: ModuleType, titles: dict[str, str]) -> None:
    control = services.control

    @ui.page(path)
    def show(request: Request) -> None:
        page, client = open_page(services, request), ui.context.client
        _LANGUAGES[client] = page.language
        ui.page_title(tr("{page} \N{EM DASH} operator's bench", page=tr(module.TITLE)))
        client.page = copy(client.page)  # it is one for all visitors, and each has a language
        client.page.language = QUASAR_LANGUAGES[page.language]

        def closed() -> None:
            control.page_closed(page.browser, client.id, time.monotonic())

        # before it connects: a slow browser may take longer from page to page than the grace of the right
        control.page_opened(page.browser, client.id)
        client.on_connect(lambda: control.page_opened(page.browser, client.id))
        client.on_disconnect(closed)
        client.on_delete(closed)
        notify_unexpected()
        build_page(page, path, titles, module.build)


def _language_of_client() -> str:
    """Return the language of the page in whose context code runs; English outside of any."""
    try:
        return _LANGUAGES.get(ui.context.client, ENGLISH)
    except RuntimeError:
        return ENGLISH


def open_page(services: PageServices, request: Request) -> OpenPage:
    """Return the page for this request, which the guard has let in."""
    owner, browser = request.scope["bench"]
    return OpenPage(
        services=services,
        user=owner.name,
        role=owner.role,
        address=request.client.host if request.client else "",
        browser=browser,
        session=request.cookies.get(SESSION_COOKIE, ""),
        units=unit_system(request.cookies.get(UNITS_COOKIE)),
        dark=request.cookies.get(DARK_COOKIE) == "1",
        language=chosen_language(
            request.cookies.get(LANGUAGE_COOKIE),
            request.headers.get("accept-language", ""),
            services.language,
        ),
    )


def add_stop(services: PageServices) -> None:
    """Add the route of STOP, which every visitor may use and which needs no websocket."""

    @app.post("/stop")
    async def stop(request: Request) -> JSONResponse:
        page = open_page(services, request)
        answer = await services.link.request(page.who, "command", command=Command.QUICK_STOP.name.lower())
        reason = controller_text(answer.reason, page.language)
        return JSONResponse({"accepted": answer.accepted, "reason": reason})
