"""The login page: plain HTML without a script, so that a stranger reaches nothing else of us."""

from __future__ import annotations

import asyncio
import html
import logging
import time
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import parse_qs

from starlette.requests import Request  # noqa: TC002  # FastAPI reads the annotation
from starlette.responses import HTMLResponse, RedirectResponse, Response

from servo_ctrl.hmi.guard import LOGIN, SESSION_COOKIE, cookie
from servo_ctrl.hmi.sessions import LASTS_S, Failures

if TYPE_CHECKING:
    from fastapi import FastAPI

    from servo_ctrl.hmi.access import Access
    from servo_ctrl.hmi.sessions import Sessions

_LOG = logging.getLogger(__name__)
_LARGEST_FORM = 1024
_PAGE = (Path(__file__).parent / "static" / "login.html").read_text(encoding="utf-8")


def _page(message: str, status: int) -> Response:
    return HTMLResponse(_PAGE.replace("{message}", html.escape(message)), status)


def add_login(app: FastAPI, access: Access, sessions: Sessions) -> None:
    """Login and logout; both are behind the guard."""
    failures = Failures()

    @app.get(LOGIN)
    async def show() -> Response:
        return _page("", 200) if access.login_needed else RedirectResponse("/", 303)

    @app.post(LOGIN)
    async def log_in(request: Request) -> Response:
        address, now_s = request.client.host if request.client else "", time.monotonic()
        if (wait_s := failures.wait_s(address, now_s)) > 0.0:
            return _page(f"Too many attempts. Try again in {wait_s:.0f} s.", 429)
        failures.note(address, now_s)  # until it has proved right: attempts at the same time count too
        token = await _token_of(request)
        entry = access.entry_of(token)
        if entry is None:
            _LOG.warning("log-in with an unknown token from %s", address)
            return _page("This token is not known here.", 401)
        failures.forgive(address)
        _LOG.info("%s (%s) logged in from %s", entry.name, entry.role.word, address)
        response = RedirectResponse("/", 303)
        secret = sessions.begin(entry, now_s)
        response.headers.append(
            "set-cookie", cookie(SESSION_COOKIE, secret, secure=True, lasts_s=int(LASTS_S))
        )
        return response

    @app.post("/logout")
    async def log_out(request: Request) -> Response:
        sessions.end(request.cookies.get(SESSION_COOKIE))
        response = RedirectResponse(LOGIN, 303)
        response.headers.append("set-cookie", cookie(SESSION_COOKIE, "", secure=True, lasts_s=0))
        return response


async def _token_of(request: Request) -> str:
    """The token of the form; "" when there is none within bounds."""
    body = b""
    try:
        async with asyncio.timeout(5.0):
            async for piece in request.stream():
                body += piece
                if len(body) > _LARGEST_FORM:
                    return ""
        fields = parse_qs(body.decode("ascii"), max_num_fields=4)
    except (TimeoutError, ValueError):
        return ""
    return fields.get("token", [""])[0].strip()
