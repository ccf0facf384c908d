"""What all pages have in the browser: marks of elements, the look of input fields, and stored preferences."""

from nicegui import ui
from nicegui.element import Element
from starlette.requests import Request

UNITS_COOKIE, DARK_COOKIE = "bench_units", "bench_dark"
"""Preferences of a browser: unit system, dark or light. None of them is secret."""
_mark_on_server = Element.mark


def _mark_in_browser(self: Element, *markers: str) -> Element:
    _mark_on_server(self, *markers)
    self.props["data-testid"] = " ".join(markers)
    return self


def configure_elements() -> None:
    """Make `element.mark("name")` set `data-testid` too: one name for tests and for scripts of users."""
    setattr(Element, "mark", _mark_in_browser)  # noqa: B010  # mypy refuses the assignment to a method
    for field in (ui.input, ui.number, ui.select):
        field.default_props("outlined dense")


def stored_preference(request: Request, name: str) -> str | None:
    """The cookie as the browser sent it, unchecked; None without one."""
    return request.cookies.get(name)


def store_preference(name: str, value: str) -> None:
    """Store a preference in the browser for a year."""
    ui.run_javascript(f"document.cookie = '{name}={value}; path=/; max-age=31536000; samesite=strict'")
