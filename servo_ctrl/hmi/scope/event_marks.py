"""The events of the machine within the picture of the scope, as marks with a number, and in words."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from servo_ctrl.commands.bus_status import EventEntry
from servo_ctrl.hmi.languages.controller_messages import controller_text
from servo_ctrl.hmi.scope.stream import CapturedRows
from servo_ctrl.hmi.shell.event_texts import when

MOST = 12
"""Marks of one picture, the newest: more would hide the curves. Chosen."""


class EventMark(NamedTuple):
    """One event."""

    at_s: float
    """From time zero of the picture."""
    text: str


def event_marks(
    events: Sequence[EventEntry], rows: CapturedRows, origin: int, cycle_place: int, period_s: float
) -> list[EventMark]:
    """Return the events whose cycle is within the rows (n, channels), in the order of time."""
    if not len(rows.values) or not events:
        return []
    cycles = rows.values[:, cycle_place]
    marks = []
    for event in events:
        place = int(np.searchsorted(cycles, event.cycle))
        if cycles[0] <= event.cycle <= cycles[-1] and place < len(cycles):
            at_s = (rows.first + place - origin) * period_s
            marks.append(EventMark(at_s, f"{when(event)} {controller_text(event.text)}"))
    return marks[-MOST:]


def marks_text(marks: Sequence[EventMark]) -> str:
    """Return the marks in words, one a line, by their numbers in the picture."""
    return "\n".join(f"{number}  {mark.text}" for number, mark in enumerate(marks, start=1))
