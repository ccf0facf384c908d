"""Which rows the scope shows: free running, or about a trigger (auto, normal, single). Row numbers only."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Sequence

Mode = Literal["auto", "normal", "single"]


class Settings(NamedTuple):
    """How a picture is taken; counts of rows."""

    span: int
    """Length of the picture."""
    before: int = 0
    """Of which before the trigger."""
    mode: Mode = "auto"
    free: bool = True
    """No trigger: the newest rows."""
    patience: int = 500
    """Auto: so long without a trigger, and it runs free."""


class Picture(NamedTuple):
    """Rows [first, last) by their numbers, last not all there yet. `origin` is where the time is zero."""

    first: int
    last: int
    origin: int
    triggered: bool


class Capture(NamedTuple):
    """Where the scope is."""

    armed_from: int
    """Triggers count from this row on."""
    shown: Picture | None = None
    filling: bool = False
    """The picture is about a trigger, and rows are still to come."""
    done: bool = False
    """Single: the picture is taken."""


def begin(newest: int) -> Capture:
    """Armed from the row to come."""
    return Capture(newest)


def advance(settings: Settings, capture: Capture, triggers: Sequence[int], newest: int) -> Capture:
    """The next state: `triggers` fired since the last call (rising row numbers), rows [.., newest) are there.

    A trigger within a picture is not looked at; behind it the next one counts. Of several pictures that
    were completed since the last call the last one stays.
    """
    if settings.free:
        return Capture(newest, _rolling(settings, newest))
    if capture.done:
        return capture
    for trigger in triggers:
        capture = _completed(settings, capture, newest)
        if not capture.done and not capture.filling and trigger >= capture.armed_from:
            first = trigger - settings.before
            capture = Capture(trigger, Picture(first, first + settings.span, trigger, triggered=True), True)
    capture = _completed(settings, capture, newest)
    if (
        settings.mode == "auto"
        and not capture.filling
        and newest - capture.armed_from > _patience(settings, capture)
    ):
        return capture._replace(shown=_rolling(settings, newest))
    return capture


def _patience(settings: Settings, capture: Capture) -> int:
    """A picture about a trigger stays for as long as it is; without one there is nothing to wait for."""
    kept = capture.shown is not None and capture.shown.triggered
    return max(settings.patience, settings.span) if kept else settings.patience


def _rolling(settings: Settings, newest: int) -> Picture:
    return Picture(newest - settings.span, newest, newest, triggered=False)


def _completed(settings: Settings, capture: Capture, newest: int) -> Capture:
    if not capture.filling or capture.shown is None or newest < capture.shown.last:
        return capture
    return Capture(capture.shown.last, capture.shown, filling=False, done=settings.mode == "single")
