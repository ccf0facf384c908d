"""Content that follows the controller, sent to the browser only when what it shows has changed."""

import time
from collections.abc import Awaitable, Callable, Hashable, Mapping, Sequence
from functools import partial
from html import escape
from typing import Any, Generic, TypeVar

from nicegui import app, ui

from servo_ctrl.commands.command import Command
from servo_ctrl.commands.local_messages import Hello
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.hmi.languages.texts import tr
from servo_ctrl.hmi.shell.live_elements import LiveHtml
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import button, confirmed, div, named

Refresh = Callable[[MachineStatus], Awaitable[None] | None]

T = TypeVar("T")
REFRESH_S = 0.2
"""Interval of the refreshes, seconds; chosen: every second status, which is fast enough to read."""


def connected_content(
    page: OpenPage, make: Callable[[Hello], Refresh], same: Callable[[Hello], object] = lambda hello: hello
) -> Callable[[], Awaitable[None] | None]:
    """Build the content once the controller has described itself; return what refreshes it.

    `make` builds the content and returns its refresh. It is called again when `same(hello)` has changed, as
    after a restart of the controller with another machine.
    """
    place = div("bench-column")
    with place:
        ui.label(tr("Waiting for the controller …")).mark("waiting")
    built_for: object = None
    refresh: Refresh = lambda _status: None  # noqa: E731  # until there is content

    def refresh_content() -> Awaitable[None] | None:
        nonlocal built_for, refresh
        hello, status = page.link.hello, page.link.status
        if hello is None or status is None:
            return None
        if built_for != same(hello):
            place.clear()
            with place:
                refresh = make(hello)
            built_for = same(hello)
        return refresh(status)

    return refresh_content


def when_connected(
    page: OpenPage, make: Callable[[Hello], Sequence[Callable[[MachineStatus], None]]]
) -> None:
    """Build the content as `connected_content` does and refresh its parts five times a second."""

    def build(hello: Hello) -> Refresh:
        parts = make(hello)

        def refresh_parts(status: MachineStatus) -> None:
            for refresh_part in parts:
                try:
                    refresh_part(status)
                except Exception as error:  # noqa: BLE001  # a card that fails must not leave the others old
                    app.handle_exception(error)

        return refresh_parts

    refresh = connected_content(page, build)
    refresh()
    ui.timer(REFRESH_S, refresh)


def command_buttons(
    page: OpenPage,
    looks: Mapping[Command, tuple[str, str]],
    style: str,
    axis: Callable[[Command], str] = lambda _command: "",
    doubt: Callable[[Command], str] = lambda _command: "",
) -> dict[Command, ui.button]:
    """Make a button with text and icon for each command, marked with its name; the first is the main action.

    `axis` returns the axis that a command is for at a click, "" = all; `doubt` returns a reason against the
    command, which the visitor confirms first.
    """

    async def send(command: Command) -> None:
        against, text = doubt(command), tr(looks[command][0])
        if not against or await confirmed(tr("{command} nevertheless?", command=text), against, text):
            await page.command(command, axis(command))

    return {
        command: button(
            tr(text),
            partial(send, command),
            command.name.lower().replace("_", "-"),
            icon=icon,
            look="outline" if number else "unelevated",
        ).style(style)
        for number, (command, (text, icon)) in enumerate(looks.items())
    }


class Rebuilt(Generic[T]):
    """An element whose children `make(value)` rebuilds when the value has changed."""

    def __init__(self, element: ui.element, make: Callable[[T], None]) -> None:
        self.element = element
        self._make = make
        self._shown: T | None = None

    def show(self, value: T) -> None:
        """Show this value; nothing happens when it is shown already."""
        if value != self._shown:
            self._shown = value
            self.element.clear()
            with self.element:
                self._make(value)


class Plot:
    """A plotly figure that is made and sent only when its key has changed."""

    def __init__(self, mark: str, label: str, height_px: int = 280) -> None:
        self._shown: Hashable = None
        self._next_s = 0.0
        self.element = ui.plotly({"data": [], "layout": {}}).mark(mark)
        self.element.style(f"width: 100%; height: {height_px}px").props("role=img")
        named(self.element, label)

    def show(
        self, key: Hashable, make: Callable[[], dict[str, Any]], *, at_most_every_s: float = 0.0
    ) -> None:
        """Show the figure of `make`; `key` has to differ whenever the figure does."""
        now_s = time.monotonic()
        if key != self._shown and now_s >= self._next_s:
            self._shown, self._next_s = key, now_s + at_most_every_s
            self.element.update_figure(make())


class TextTable:
    """A table of texts as one HTML element: an element for each cell would cost the browser much more."""

    def __init__(self, mark: str, head: Sequence[str] = (), *, figures: bool = False) -> None:
        """`figures`: the first cell of a row names it, the others are numbers."""
        self._head, self._figures = head, figures
        self._html = LiveHtml().classes("bench-scroll").mark(mark)
        self._html.style("max-height: 360px; overflow: auto")

    def show(self, rows: Sequence[Sequence[str]], head: Sequence[str] | None = None) -> None:
        """Show these rows, and another head where one is given; every text is escaped.

        What follows a line break in the first cell of a row is small print.
        """
        self._head = head or self._head
        name, kind, width = (
            ("th scope=row", " class=num", "max-width: 760px") if self._figures else ("td", "", "")
        )
        top = "".join(f"<th scope=col>{escape(cell)}</th>" for cell in self._head)
        body = "".join(
            f"<tr><{name}>{_with_small_print(row[0])}</{name[:2]}>"
            + "".join(f"<td{kind}>{escape(cell)}</td>" for cell in row[1:])
            + "</tr>"
            for row in rows
        )
        parts = f"<thead><tr>{top}</tr></thead><tbody>{body}</tbody>"
        self._html.set_content(f'<table class="bench-table" style="{width}">{parts}</table>')

    def clear(self) -> None:
        """Show no table at all."""
        self._html.set_content("")


def _with_small_print(text: str) -> str:
    """Return the text as HTML; its second line small."""
    words, _, small = text.partition("\n")
    return escape(words) + (f"<br><small>{escape(small)}</small>" if small else "")
