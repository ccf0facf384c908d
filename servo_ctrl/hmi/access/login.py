"""The login page: plain HTML without a script, the only page for visitors who are not logged in."""

import asyncio
import logging
import time
from urllib.parse import parse_qs

from fastapi import FastAPI
from starlette.requests import Request  # FastAPI reads the annotation
from starlette.responses import HTMLResponse, RedirectResponse, Response

from servo_ctrl.files.html_template import filled
from servo_ctrl.hmi.access.guard import LOGIN, SESSION_COOKIE, set_cookie
from servo_ctrl.hmi.access.sessions import SESSION_LIFETIME_S, LoginFailures, Sessions
from servo_ctrl.hmi.access.users import Access
from servo_ctrl.hmi.languages.texts import LANGUAGE_COOKIE, catalogue, chosen_language, word

_LOG = logging.getLogger(__name__)
MAX_FORM_BYTES = 1024
"""Bounds the body of the login form; chosen: a form with a token has about 60 bytes."""
FORM_TIME_S = 5.0
"""Bounds the time in which the form must arrive, seconds; chosen, against clients that hold connections
open."""
TEXTS = {
    "title": word("Operator's bench: log in"),
    "heading": word("Operator's bench"),
    "token": word("Token"),
    "action": word("Log in"),
    "hint": word("Tokens are made at the controller:"),
}


def _page(request: Request, default: str | None, message: str, status: int, **values: object) -> Response:
    """Return the form in the visitor's language, with a message that was marked by `word`."""
    cookie, accepted = request.cookies.get(LANGUAGE_COOKIE), request.headers.get("accept-language", "")
    language = chosen_language(cookie, accepted, default)
    texts = {key: catalogue(language).get(text, text) for key, text in (TEXTS | {"message": message}).items()}
    texts["message"] = texts["message"].format(**values)
    return HTMLResponse(filled("servo_ctrl.hmi", "static/login.html", language=language, **texts), status)


def add_login(app: FastAPI, access: Access, sessions: Sessions, language: str | None = None) -> None:
    """Add the routes for logging in and out; the guard is in front of both. `language`: without a choice."""
    failures = LoginFailures()

    @app.get(LOGIN)
    async def show(request: Request) -> Response:
        return _page(request, language, "", 200) if access.login_needed else RedirectResponse("/", 303)

    @app.post(LOGIN)
    async def log_in(request: Request) -> Response:
        address, now_s = request.client.host if request.client else "", time.monotonic()
        if (delay_s := failures.delay_s(address, now_s)) > 0.0:
            return _page(
                request,
                language,
                word("Too many attempts. Try again in {delay_s:.0f} s."),
                429,
                delay_s=delay_s,
            )
        failures.record(address, now_s)  # before the check, so that attempts at the same time count too
        owner = access.owner_of(await _token_in(request))
        if owner is None:
            _LOG.warning("log-in with an unknown token from %s", address)
            return _page(request, language, word("This token is not known here."), 401)
        failures.clear(address)
        _LOG.info("%s (%s) logged in from %s", owner.name, owner.role.label, address)
        response = RedirectResponse("/", 303)
        secret = sessions.begin(owner, now_s)
        cookie = set_cookie(SESSION_COOKIE, secret, secure=True, lifetime_s=int(SESSION_LIFETIME_S))
        response.headers.append("set-cookie", cookie)
        return response

    @app.post("/logout")
    async def log_out(request: Request) -> Response:
        sessions.end(request.cookies.get(SESSION_COOKIE))
        response = RedirectResponse(LOGIN, 303)
        response.headers.append("set-cookie", set_cookie(SESSION_COOKIE, "", secure=True, lifetime_s=0))
        return response


async def _token_in(request: Request) -> str:
    """Return the token of the form; "" when the form is too long, too slow or has none."""
    body = b""
    try:
        async with asyncio.timeout(FORM_TIME_S):
            async for piece in request.stream():
                body += piece
                if len(body) > MAX_FORM_BYTES:
                    return ""
        fields = parse_qs(body.decode("ascii"), max_num_fields=4)
    except (TimeoutError, ValueError):
        return ""
    return fields.get("token", [""])[0].strip()
