"""The elements that the pages are made of: cards, buttons, fields, states in a word, switches and questions.

NiceGUI's Tailwind is off; the layout comes from Quasar and from the `bench-` classes of static/bench.css.
"""

import logging
import time
from collections.abc import Awaitable, Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Literal, TypeVar

from nicegui import ui
from nicegui.element import Element
from nicegui.events import GenericEventArguments

from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.hmi.languages.controller_messages import controller_text
from servo_ctrl.hmi.languages.texts import tr
from servo_ctrl.hmi.shell.live_elements import LiveBar, LiveLabel
from servo_ctrl.hmi.shell.machine_stage import Tone

ELLIPSIS = "\N{HORIZONTAL ELLIPSIS}"
WARNING = "\N{WARNING SIGN}"
CHECK = "\N{CHECK MARK}"
CROSS = "\N{HEAVY MULTIPLICATION X}"
Kind = Literal["positive", "negative", "warning", "info", "ongoing"]
"""Kinds of a notice in NiceGUI."""
ButtonLook = Literal["outline", "unelevated", "flat"]
E = TypeVar("E", bound=Element)
_OPTION = """
<q-item v-bind="props.itemProps">
  <q-item-section>
    <q-item-label>{{ props.opt.label.split("\\n")[0] }}</q-item-label>
    <q-item-label caption>{{ props.opt.label.split("\\n")[1] }}</q-item-label>
  </q-item-section>
</q-item>
"""
MAX_REASON = 300
"""Bounds the characters of an unexpected error that a notice shows; chosen."""
SAME_PROBLEM_S = 10.0
"""Period of the notice of a timer that fails five times a second; chosen."""
_LOG = logging.getLogger(__name__)
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


def notify(text: str, kind: Kind = "warning") -> None:
    """Show a sentence to the visitor for six seconds, at the bottom: nothing may cover STOP in the head."""
    ui.notify(text, type=kind, position="bottom", timeout=6000, multi_line=True, close_button="OK")


def problem_text(error: Exception) -> str:
    """Return the text of an error for the visitor; log an unexpected one with its traceback."""
    if isinstance(error, ServoCtrlError | OSError):
        return controller_text(str(error))
    _LOG.error("unexpected error", exc_info=error)
    return _unexpected(error)


@contextmanager
def errors_notified(kind: Kind = "negative") -> Iterator[None]:
    """Show the visitor an error that ends the block, instead of raising it."""
    try:
        yield
    except Exception as error:  # noqa: BLE001  # the visitor sees any error, and the page goes on
        notify(problem_text(error), kind)


def notify_unexpected() -> None:
    """Notify the visitor of this page of every error that one of its handlers or timers raises.

    NiceGUI only logs these errors: the visitor would see that nothing happens.
    """
    shown_s: dict[str, float] = {}

    def show(error: Exception) -> None:
        text, now_s = _unexpected(error), time.monotonic()
        if now_s - shown_s.get(text, -SAME_PROBLEM_S) >= SAME_PROBLEM_S:
            shown_s[text] = now_s
            notify(text, "negative")

    ui.on_exception(show)


def _unexpected(error: Exception) -> str:
    reason = f"{type(error).__name__}: {error}"[:MAX_REASON]
    return tr("Unexpected error ({reason}). The log of the page's process has more.", reason=reason)


def div(classes: str = "") -> ui.element:
    """Make a plain element with these CSS classes."""
    return ui.element("div").classes(classes)


def named(element: E, label: str) -> E:
    """Name an element for screen readers; any character may be in the name. Return the element."""
    element.props["aria-label"] = label
    return element


@contextmanager
def card(title: str, mark: str) -> Iterator[ui.element]:
    """Make a card with a heading."""
    with panel(title).mark(mark) as element:
        with ui.element("h2"):
            ui.label(title)
        yield element


def panel(label: str) -> ui.element:
    """Make a card without a visible heading; `label` is for screen readers."""
    return named(ui.element("section").classes("bench-card"), label)


def button(
    text: str,
    on_click: Callable[[], Any],
    mark: str,
    *,
    icon: str | None = None,
    look: ButtonLook = "outline",
) -> ui.button:
    """Make a button; `unelevated` is the look of the main action of a card."""
    return ui.button(text, icon=icon, on_click=on_click).props(look).mark(mark)


def choice(options: Any, label: str, mark: str, style: str = "", **fields: Any) -> ui.select:
    """Make a list to choose from; `fields` are those of `ui.select`."""
    return ui.select(options, label=label, **fields).props("options-dense").mark(mark).style(style)


def with_small_print(select: ui.select) -> ui.select:
    """Show the second line of each option's label as small print, in the list alone; return the list."""
    select.props[":option-label"] = "option => String(option?.label ?? '').split('\\n')[0]"
    select.add_slot("option", _OPTION)
    return select


def toggle(options: Any, mark: str, value: Any) -> ui.toggle:
    """Make a row of buttons of which one is chosen."""
    return ui.toggle(options, value=value).props("no-caps unelevated").mark(mark)


def faint(text: str = "") -> ui.label:
    """Make an explanation or a value of secondary importance."""
    return ui.label(text).classes("bench-faint")


def note(mark: str, tone: Literal["", "warn", "bad"] = "warn") -> ui.label:
    """Make a note with a coloured edge, hidden while its text is empty."""
    label = ui.label().classes(f"bench-note {tone}").style("overflow-wrap: anywhere").mark(mark)
    return label.bind_visibility_from(label, "text", bool)


def pairs(names: Mapping[str, str], mark: str) -> dict[str, LiveLabel]:
    """Make lines of a name and a value; return the labels of the values by key, each marked with its key."""
    labels = {}
    for key, name in names.items():
        ui.label(name)
        labels[key] = LiveLabel().classes("num").mark(mark.format(key))
    return labels


def captioned(name: str, text: str = "") -> LiveLabel:
    """Make a value below its name in small letters."""
    with div():
        faint(name).style("font-size: 12px")
        return LiveLabel(text)


def progress_bar(label: str, mark: str) -> LiveBar:
    """Make a bar for a share from 0 to 1; `label` is for screen readers."""
    return named(LiveBar().mark(mark), label)


class Pill:
    """A state in a word with a sign; its tone colours it."""

    def __init__(self, mark: str) -> None:
        self.label = ui.label().mark(mark).props("role=status aria-live=polite")
        self.label.classes("bench-pill calm")

    def show(self, text: str, tone: Tone) -> None:
        """Show another state."""
        self.label.set_text(text)
        self.label.classes(replace=f"bench-pill num {tone}")


def add_tooltip(element: ui.element, meaning: str) -> None:
    """Show the meaning of a field as its tooltip.

    Inside of it: `Element.tooltip` looks for it in the document, where it is not while a hidden tab is built.
    """
    with element:
        ui.tooltip(meaning)


class Switch:
    """A switch that shows the state of the machine and asks the machine for the other one."""

    def __init__(self, text: str, mark: str, on_flip: Callable[[bool], Awaitable[object]]) -> None:
        self._on_flip, self._waiting = on_flip, False
        self._element = ui.switch(text).mark(mark).style("min-height: 44px")
        self._element.on("update:model-value", self._flipped, [None])

    def show(self, on: bool) -> None:
        """Show the state of the machine, unless a request is under way."""
        if not self._waiting:
            self._element.set_value(on)

    def _flipped(self, event: GenericEventArguments) -> Awaitable[None]:
        # read the event before the task starts: a refresh may set the element back meanwhile
        self._waiting = True
        return self._ask(on=event.args is True)

    async def _ask(self, *, on: bool) -> None:
        try:
            await self._on_flip(on)
        finally:
            self._waiting = False


async def confirmed(question: str, details: str, action: str) -> bool:
    """Ask the visitor whether something with consequences is to be done; not where the page is closed."""
    with ui.dialog() as dialog, ui.card().classes("bench-card"):
        ui.label(question).style("font-size: 18px; font-weight: 600")
        ui.label(details).style("white-space: pre-line; overflow-wrap: anywhere")
        with div("bench-row"):
            button(action, lambda: dialog.submit(True), "confirm", look="unelevated")
            button(tr("Leave it"), lambda: dialog.submit(False), "leave-it", look="flat")
    answer = await dialog
    if not dialog.is_deleted:  # as it is with its page
        dialog.delete()
    return bool(answer)
