"""What a browser remembers for its user: units, dark or light. Nothing of it is secret."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nicegui import ui

if TYPE_CHECKING:
    from starlette.requests import Request

UNITS_COOKIE, DARK_COOKIE = "bench_units", "bench_dark"


def remembered(request: Request, name: str) -> str | None:
    """The preference of that name, as the browser has sent it; whoever uses it has to check it."""
    return request.cookies.get(name)


def remember(name: str, value: str) -> None:
    """Leave a preference in the browser, for a year."""
    ui.run_javascript(f"document.cookie = '{name}={value}; path=/; max-age=31536000; samesite=strict'")
