"""`element.mark("name")` reaches the browser, too, as `data-testid`: one name for tests and for scripts."""

from __future__ import annotations

from nicegui.element import Element

_mark = Element.mark


def _marked(self: Element, *markers: str) -> Element:
    _mark(self, *markers)
    self.props["data-testid"] = " ".join(markers)
    return self


def show_marks() -> None:
    """For all elements from now on; the library itself keeps marks to the server."""
    setattr(Element, "mark", _marked)  # noqa: B010  # a method is not to be assigned to, says mypy
