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
        with self._props.suspend_updates():
            self._text_to_model_text(text)
        self.run_method("show", text)


class LiveHtml(ui.html, component="live_html.js"):
    """HTML that changes all the time; whoever sets it has escaped what is not his own."""

    def __init__(self) -> None:
        super().__init__("", sanitize=False)

    def _handle_content_change(self, content: str) -> None:
        with self._props.suspend_updates():
            self._props["innerHTML"] = content
        self.run_method("show", content)


class LivePlace(Element, component="live_place.js"):
    """A mark that moves in the box around it; hidden until it has a place."""

    def __init__(self) -> None:
        super().__init__()
        self._props["place"] = None

    def show(self, left_percent: float, top_percent: float | None = None) -> None:
        """Show it at this share of the box from its left and, if given, from its top."""
        top = {} if top_percent is None else {"top": f"{top_percent:.2f}%"}
        self._move({"left": f"{left_percent:.2f}%", **top})

    def hide(self) -> None:
        """Show it nowhere."""
        self._move(None)

    def _move(self, place: dict[str, str] | None) -> None:
        if place != self._props["place"]:
            with self._props.suspend_updates():
                self._props["place"] = place
            self.run_method("move", place)
