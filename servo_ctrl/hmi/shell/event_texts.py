"""Events as the pages show them: by the clock, repeated ones as one with a count."""

import re
from collections.abc import Sequence
from datetime import datetime
from typing import NamedTuple

from servo_ctrl.commands.bus_status import EventEntry
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.hmi.languages.controller_messages import controller_text
from servo_ctrl.hmi.languages.texts import tr, word
from servo_ctrl.hmi.shell.units import grouped

SAME_CYCLES = 100
"""Most cycles between a request in the events and the stop that it causes; chosen."""
LONGEST_GROUP = 8
"""Events of a group that may be repeated; one for each node of a machine, and its cause. Chosen."""
_REQUESTS = {
    "quick stop by the operator": ("quick_stop", word("quick stop by {who}")),
    "switched off by the operator": ("disable", word("switched off by {who}")),
}
"""The command behind a reason, whose event names who asked, and how the reason is shown with that name."""
_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(\.\d+)?(?![\w.])")


class ShownEvent(NamedTuple):
    """The newest of events that differ in their numbers only, and how many they are."""

    event: EventEntry
    times: int


def when(event: EventEntry) -> str:
    """Return the local time of an event; its cycle where the status has no time."""
    return _clock(event.time) or tr("cycle {number}", number=grouped(event.cycle))


def coalesced(events: Sequence[EventEntry]) -> list[ShownEvent]:
    """Return the events in their order, repeated ones once: the newest, with their number.

    Repeated is what differs in numbers only: an event behind itself, or a group of events behind the same
    group, as when every node of a bus is lost again and again under overload.
    """
    shown: list[ShownEvent] = []
    alike: list[str] = []
    for event in events:
        shown.append(ShownEvent(event, 1))
        alike.append(_alike(event.text))
        for length in range(1, LONGEST_GROUP + 1):
            if 2 * length <= len(alike) and alike[-length:] == alike[-2 * length : -length]:
                before, newest = shown[-2 * length : -length], shown[-length:]
                shown[-2 * length :] = [
                    ShownEvent(new.event, old.times + new.times)
                    for old, new in zip(before, newest, strict=True)
                ]
                del alike[-length:]
                break
    return shown


def reason_text(status: MachineStatus) -> str:
    """Return why the machine has stopped, in the language of the page, with the local time if known."""
    first = status.reason.split("; ")[0]
    events = list(reversed(status.events))
    stop = next((event for event in events if first and first in event.text), None)
    reason = controller_text(status.reason)
    if stop is None:
        return reason
    command, named = _REQUESTS.get(first, ("", ""))
    for event in events:
        if command and event.text.endswith(f": {command}") and abs(event.cycle - stop.cycle) <= SAME_CYCLES:
            who = event.text.removesuffix(f": {command}")
            reason = reason.replace(controller_text(first), tr(named, who=who), 1)
            break
    return tr("{reason}, at {clock}", reason=reason, clock=_clock(stop.time)) if _clock(stop.time) else reason


def _clock(time: str) -> str:
    try:
        return datetime.fromisoformat(time).astimezone().strftime("%H:%M:%S")
    except ValueError:
        return ""


def _alike(text: str) -> str:
    return _NUMBER.sub("#", text)
