"""Elements whose content changes several times a second without rendering the page again.

At an update of a NiceGUI element the browser renders all elements of the page, 6 to 40 ms of processor time.
These send what has changed to a component of their own, and keep it for a browser that connects later.
"""

from typing import Any

from nicegui.element import Element
from nicegui.elements.mixins.text_element import TextElement

COMPONENT = "live_element.js"


class LiveLabel(TextElement, component=COMPONENT):
    """A label for a text that changes all the time."""

    def __init__(self, text: str = "") -> None:
        super().__init__(text=text)
        self._props["what"] = "text"

    def _text_to_model_text(self, text: str) -> None:
        self._props["shown"] = text

    def _handle_text_change(self, text: str) -> None:
        _write(self, text)


class LiveHtml(Element, component=COMPONENT):
    """HTML that changes all the time; its caller has escaped every text from outside."""

    def __init__(self) -> None:
        super().__init__()
        self._props |= {"what": "html", "shown": ""}

    def set_content(self, html: str) -> None:
        """Show other HTML."""
        _write(self, html)


class LiveBar(Element, component=COMPONENT):
    """A bar for a share from 0 to 1."""

    def __init__(self) -> None:
        super().__init__()
        self._props |= {"what": "share", "shown": 0.0}
        self.classes("bench-progress").props("role=progressbar aria-valuemin=0 aria-valuemax=1")

    def set_share(self, share: float) -> None:
        """Fill it to a thousandth, which is less than a pixel."""
        _write(self, round(share, 3))


class LivePlace(Element, component=COMPONENT):
    """A mark that moves in the box around it; hidden until it has a place."""

    def __init__(self) -> None:
        super().__init__()
        self._props |= {"what": "place", "shown": None}

    def show(self, left_percent: float, top_percent: float | None = None) -> None:
        """Show it at this share of the box from its left and, if given, from its top."""
        top = {} if top_percent is None else {"top": f"{top_percent:.2f}%"}
        _write(self, {"left": f"{left_percent:.2f}%", **top})

    def hide(self) -> None:
        """Show it nowhere."""
        _write(self, None)


def _write(element: Element, value: Any) -> None:
    """Keep another value without an update, and have the element's component show it."""
    if value == element.props.get("shown"):
        return
    with element.props.suspend_updates():
        element.props["shown"] = value
    element.run_method("show", value)
