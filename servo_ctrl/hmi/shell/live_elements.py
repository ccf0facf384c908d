"""Elements whose content changes several times a second without rendering the page anew.

At an update of a NiceGUI element the browser renders all elements of the page, 6 to 40 ms of processor time.
These send what has changed to a component of their own, and keep it for a browser that connects later.
"""

from nicegui import ui
from nicegui.element import Element
from nicegui.elements.mixins.text_element import TextElement


class LiveLabel(TextElement, component="live_label.js"):
    """A label for a text that changes all the time."""

    def __init__(self, text: str = "") -> None:
        super().__init__(text=text)

    def _text_to_model_text(self, text: str) -> None:
        self._props["text"] = text

    def _handle_text_change(self, text: str) -> None:
        _write(self, "text", text)


class LiveHtml(ui.html, component="live_html.js"):
    """HTML that changes all the time; whoever sets it has escaped what is not his own."""

    def __init__(self) -> None:
        super().__init__("", sanitize=False)

    def _handle_content_change(self, content: str) -> None:
        _write(self, "innerHTML", content)


class LiveBar(Element, component="live_bar.js"):
    """A bar for a share from 0 to 1."""

    def __init__(self) -> None:
        super().__init__()
        self._props["share"] = 0.0

    def set_share(self, share: float) -> None:
        """Fill it to a thousandth, which is less than a pixel."""
        share = round(share, 3)
        if share != self._props["share"]:
            _write(self, "share", share)


class LivePlace(Element, component="live_place.js"):
    """A mark that moves in the box around it; hidden until it has a place."""

    def __init__(self) -> None:
        super().__init__()
        self._props["place"] = None

    def show(self, left_percent: float, top_percent: float | None = None) -> None:
        """Show it at this share of the box from its left and, if given, from its top."""
        top = {} if top_percent is None else {"top": f"{top_percent:.2f}%"}
        self._place({"left": f"{left_percent:.2f}%", **top})

    def hide(self) -> None:
        """Show it nowhere."""
        self._place(None)

    def _place(self, place: dict[str, str] | None) -> None:
        if place != self._props["place"]:
            _write(self, "place", place)


def _write(element: Element, prop: str, value: object) -> None:
    """Keep a value as this property, without an update, and have the element's component show it."""
    with element.props.suspend_updates():
        element.props[prop] = value
    element.run_method("show", value)
