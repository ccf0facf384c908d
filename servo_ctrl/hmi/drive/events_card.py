"""The card of the events: filtered by words, put aside once they are read, and downloaded as a table."""

import csv
import io
from collections.abc import Sequence

from nicegui import ui

from servo_ctrl.commands.bus_status import EventEntry
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.hmi.languages.controller_messages import controller_text
from servo_ctrl.hmi.languages.texts import tr
from servo_ctrl.hmi.shell.event_texts import ShownEvent, coalesced, when
from servo_ctrl.hmi.shell.live_content import Rebuilt
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import button, card, div, faint

MAX_EVENTS = 40
"""Bounds the events that are shown; chosen: the status holds a hundred."""
FILE = "events.csv"


class EventsCard:
    """What was read is put aside on this page alone; the controller and its recording keep it."""

    def __init__(self, page: OpenPage) -> None:
        self._page = page
        self._read_up_to = -1
        """Cycle of the newest event that was read."""
        with card(tr("Events"), "events"):
            with div("bench-row"):
                self._filter = ui.input(tr("only with these words")).mark("events-filter")
                self._filter.props("clearable").style("flex: 1 1 160px")
                self._all = ui.switch(tr("read ones too")).mark("events-read")
                button(tr("Read"), self._read, "events-acknowledge", icon="done_all", look="flat")
                button(tr("Download"), self._download, "events-export", icon="download", look="flat")
            self._list = Rebuilt(div("bench-list num").props("tabindex=0 role=log"), _show)

    def refresh(self, status: MachineStatus) -> None:
        """Show the newest of the matching ones."""
        read_up_to = -1 if self._all.value else self._read_up_to
        self._list.show(matching_events(status.events, self._filter.value or "", read_up_to)[-MAX_EVENTS:])

    def _read(self) -> None:
        status = self._page.link.status
        self._read_up_to = max((event.cycle for event in status.events), default=-1) if status else -1

    def _download(self) -> None:
        status = self._page.link.status
        if status is not None:
            ui.download.content(
                events_csv(matching_events(status.events, self._filter.value or "", -1)), FILE, "text/csv"
            )


def matching_events(events: Sequence[EventEntry], words: str, read_up_to: int) -> tuple[EventEntry, ...]:
    """Return the events of later cycles that have all of these words, in upper or lower case."""
    needed = words.lower().split()
    return tuple(
        event
        for event in events
        if event.cycle > read_up_to and all(word in _searched_text(event) for word in needed)
    )


def _searched_text(event: EventEntry) -> str:
    """Return the searched text: the event as it is shown, and in the controller's own words."""
    return f"{controller_text(event.text)} {event.text}".lower()


def events_csv(events: Sequence[EventEntry]) -> str:
    """Return time (ISO 8601), cycle and text of each event in the language of the page, as CSV."""
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow((tr("time"), tr("cycle"), tr("event")))
    writer.writerows((event.time, event.cycle, controller_text(event.text)) for event in events)
    return text.getvalue()


def _show(events: Sequence[EventEntry]) -> None:
    """Show the events, the newest first."""
    for event, count in reversed(coalesced(events)):
        _row(ShownEvent(event, count))


def _row(shown: ShownEvent) -> None:
    with div():
        faint(when(shown.event))
        times = tr(" ({times} times)", times=shown.times) if shown.times > 1 else ""
        ui.label(f"{controller_text(shown.event.text)}{times}").style("overflow-wrap: anywhere")
