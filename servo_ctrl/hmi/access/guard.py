"""Checks every request before NiceGUI sees it: host, origin and log-in.

* On loopback the Host has to be a name of loopback: another site cannot reach us by a name of its own (DNS
  rebinding).
* A request that changes something, and every websocket, has to come from one of our own pages (Origin).
* Elsewhere than on loopback, a visitor who is not logged in gets the login page and nothing else.
* The headers forbid the browser to load anything from elsewhere, and to show us in a frame.
"""

import secrets
import time
from typing import Any
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import HTTPConnection
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from servo_ctrl.hmi.access.sessions import Sessions
from servo_ctrl.hmi.access.users import LOCAL_USER, Access, TokenOwner

SESSION_COOKIE, BROWSER_COOKIE = "bench_session", "bench_browser"
LOGIN = "/login"
_LOOPBACK_NAMES = frozenset({"localhost", "127.0.0.1", "::1"})
_SECRET_LENGTH = 43
"""Characters of a session's secret, from `secrets.token_urlsafe(32)`."""
_HEADERS = {
    "content-security-policy": "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; "
    "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:; "
    "worker-src 'self' blob:; object-src 'none'; base-uri 'self'; form-action 'self'; frame-ancestors 'none'",
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "same-origin",
}


class Guard:
    """ASGI middleware; puts the visitor's token owner and browser cookie into `scope["bench"]`."""

    def __init__(self, app: ASGIApp, access: Access, sessions: Sessions) -> None:
        self._app = app
        self._access = access
        self._sessions = sessions

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check one request, and pass it on or refuse it."""
        if scope["type"] not in {"http", "websocket"}:
            await self._app(scope, receive, send)
            return
        headers, cookies = Headers(scope=scope), HTTPConnection(scope).cookies
        if reason := self._refusal(scope, headers):
            await _refuse(scope, receive, send, 403, reason)
            return
        owner: TokenOwner | None = LOCAL_USER
        if self._access.login_needed:
            owner = self._sessions.owner_of(cookies.get(SESSION_COOKIE), time.monotonic())
        if owner is None and scope["path"] != LOGIN:
            is_page = scope["type"] == "http" and scope["method"] == "GET"
            if is_page and "text/html" in headers.get("accept", ""):
                await RedirectResponse(LOGIN, 303)(scope, receive, send)
            else:
                await _refuse(scope, receive, send, 401, "log in first")
            return
        browser = cookies.get(BROWSER_COOKIE, "")
        known = len(browser) == _SECRET_LENGTH
        browser = browser if known else secrets.token_urlsafe(32)
        scope["bench"] = (owner, browser)

        async def send_guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                answer = MutableHeaders(scope=message)
                answer.update(_HEADERS)
                if not known:
                    secure = self._access.login_needed
                    answer.append("set-cookie", set_cookie(BROWSER_COOKIE, browser, secure=secure))
            await send(message)

        await self._app(scope, receive, send_guarded)

    def _refusal(self, scope: Scope, headers: Headers) -> str:
        host = headers.get("host", "")
        if not self._access.login_needed and _host_name(host) not in _LOOPBACK_NAMES:
            return "this page is for this machine only; open it as localhost or 127.0.0.1"
        if scope["type"] == "websocket" or scope["method"] not in {"GET", "HEAD"}:
            origin = headers.get("origin", "")
            scheme = "https" if self._access.login_needed else "http"
            if origin != f"{scheme}://{host}":
                return "this request does not come from a page of the operator's bench"
        return ""


def set_cookie(name: str, value: str, *, secure: bool, lifetime_s: int | None = None) -> str:
    """Return the Set-Cookie value of a cookie that scripts cannot read and other sites cannot send."""
    answer = Response()
    answer.set_cookie(name, value, lifetime_s, secure=secure, httponly=True, samesite="strict")
    return answer.headers["set-cookie"]


def _host_name(host: str) -> str:
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


async def _refuse(scope: Scope, receive: Receive, send: Send, status: int, reason: str) -> None:
    if scope["type"] == "websocket":
        await receive()  # the connect
        await send({"type": "websocket.close", "code": 1008, "reason": reason})
    else:
        response: Any = PlainTextResponse(reason, status)
        await response(scope, receive, send)
