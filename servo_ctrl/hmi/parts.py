"""Pieces that several pages are made of."""

from __future__ import annotations

import time
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from nicegui import ui

from servo_ctrl.hmi.bench import LOGIN_ENDED, role_of
from servo_ctrl.hmi.notices import tell

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Hashable, Iterator, Sequence

    from nicegui.events import GenericEventArguments

    from servo_ctrl.config.local_messages import Hello
    from servo_ctrl.hmi.access import Role
    from servo_ctrl.hmi.bench import Bench, Visitor

REFRESH_S = 0.2


@contextmanager
def card(title: str, mark: str) -> Iterator[ui.element]:
    """A card with a heading."""
    with ui.element("section").classes("bench-card").props(f'aria-label="{title}"').mark(mark) as element:
        with ui.element("h2"):
            ui.label(title)
        yield element


def when_greeted(bench: Bench, make: Callable[[Hello], Callable[[], None]]) -> None:
    """Make the content once the machine has said who it is, anew when another one does; then refresh it.

    `make` returns what refreshes the content.
    """
    place = ui.element("div").classes("bench-column")
    with place:
        ui.label("Waiting for the controller \N{HORIZONTAL ELLIPSIS}").mark("waiting")
    shown: Hello | None = None
    refresh: Callable[[], None] = lambda: None  # noqa: E731  # until there is something to refresh

    def look() -> None:
        nonlocal shown, refresh
        hello = bench.link.hello
        if hello is None or bench.link.status is None:
            return
        if hello != shown:
            place.clear()
            with place:
                refresh = make(hello)
            shown = hello
        refresh()

    look()
    ui.timer(REFRESH_S, look)


class Plot:
    """A plot that is sent to the browser only when what it shows has changed."""

    def __init__(self, mark: str, label: str, height_px: int = 280) -> None:
        self._shown: Hashable = None
        self._next_s = 0.0
        self.element = ui.plotly({"data": [], "layout": {}}).mark(mark)
        self.element.style(f"width: 100%; height: {height_px}px").props(f'role=img aria-label="{label}"')

    def show(
        self, key: Hashable, make: Callable[[], dict[str, Any]], *, at_most_every_s: float = 0.0
    ) -> None:
        """Show the figure that `make` makes, unless that of this key is shown already."""
        now_s = time.monotonic()
        if key != self._shown and now_s >= self._next_s:
            self._shown, self._next_s = key, now_s + at_most_every_s
            self.element.update_figure(make())


class Table:
    """A table of texts, sent to the browser only when they change; it scrolls sideways where it has to."""

    def __init__(self, mark: str, headings: Sequence[str]) -> None:
        self._labels: list[list[ui.label]] = []
        scroll = ui.element("div").classes("bench-scroll").style("max-height: 360px; overflow: auto")
        with scroll, ui.element("table").classes("bench-table").mark(mark):
            with ui.element("thead"), ui.element("tr"):
                for heading in headings:
                    with ui.element("th").props("scope=col"):
                        ui.label(heading)
            self._body = ui.element("tbody")

    def show(self, rows: Sequence[Sequence[str]]) -> None:
        """Show these rows. Cells that are there change their text: making them anew is much dearer."""
        if [len(cells) for cells in rows] == [len(labels) for labels in self._labels]:
            for labels, cells in zip(self._labels, rows, strict=True):
                for label, cell in zip(labels, cells, strict=True):
                    label.set_text(cell)
            return
        self._body.clear()
        self._labels = []
        with self._body:
            for cells in rows:
                with ui.element("tr"):
                    self._labels.append([_cell(text) for text in cells])


def _cell(text: str) -> ui.label:
    with ui.element("td"):
        return ui.label(text)


class Switch:
    """A switch that shows what the machine says, and asks it for the other position."""

    def __init__(self, text: str, mark: str, flip: Callable[[bool], Awaitable[None]]) -> None:
        self._flip, self._waiting = flip, False
        self.element = ui.switch(text).mark(mark).style("min-height: 44px")
        self.element.on("update:model-value", self._flipped, [None])

    def show(self, on: bool) -> None:
        """What the machine says."""
        if not self._waiting:
            self.element.set_value(on)

    def _flipped(self, event: GenericEventArguments) -> Awaitable[None]:
        # from the event, and at once: the element may be shown another position before the task begins
        self._waiting = True
        return self._ask(on=event.args is True)

    async def _ask(self, *, on: bool) -> None:
        try:
            await self._flip(on)
        finally:
            self._waiting = False


async def confirmed(question: str, details: str, action: str) -> bool:
    """Ask the visitor before something is done that they might not want."""
    with ui.dialog() as dialog, ui.card().classes("bench-card"):
        ui.label(question).style("font-size: 18px; font-weight: 600")
        ui.label(details).style("white-space: pre-line; overflow-wrap: anywhere")
        with ui.element("div").classes("bench-row"):
            ui.button(action, on_click=lambda: dialog.submit(True)).props("unelevated").mark("confirm")
            ui.button("Leave it", on_click=lambda: dialog.submit(False)).props("flat").mark("leave-it")
    answer = await dialog
    dialog.delete()
    return bool(answer)


def may(bench: Bench, visitor: Visitor, needed: Role) -> bool:
    """Whether a visitor may do what does not go to the machine; they are told if not."""
    role = role_of(bench, visitor)
    if role is None:
        tell(LOGIN_ENDED)
        return False
    if role < needed:
        tell(f"This needs the role {needed.word}; yours is {role.word}.")
    return role >= needed
