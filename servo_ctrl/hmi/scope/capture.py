"""Which rows the scope shows: the newest, or a window about a trigger (auto, normal, single)."""

from collections.abc import Sequence
from typing import Literal, NamedTuple

TriggerMode = Literal["auto", "normal", "single"]


class CaptureSettings(NamedTuple):
    """How a window is chosen; counts of rows."""

    span: int
    """Length of the window."""
    before: int = 0
    """Part of it before the trigger."""
    mode: TriggerMode = "auto"
    free: bool = True
    """No trigger: the newest rows."""
    auto_wait: int = 500
    """In mode auto: rows without a trigger after which the scope runs free."""


class CaptureWindow(NamedTuple):
    """The rows [first, last) by their numbers, of which the end may still have to arrive."""

    first: int
    last: int
    origin: int
    """The row at which the time is zero."""
    triggered: bool


class CaptureState(NamedTuple):
    """The state of the capture."""

    armed_from: int
    """Triggers before this row are ignored."""
    window: CaptureWindow | None = None
    filling: bool = False
    """The window is triggered, and rows of it are still to come."""
    done: bool = False
    """In mode single: the window is complete."""


def advance(
    settings: CaptureSettings, state: CaptureState, triggers: Sequence[int], newest: int
) -> CaptureState:
    """Return the next state, by the triggers since the last call (rising row numbers) and the rows so far.

    A trigger within a window is ignored; the first one after its end counts. Of several windows that were
    completed since the last call, the last one is kept.
    """
    if settings.free:
        return CaptureState(newest, _newest_rows(settings, newest))
    if state.done:
        return state
    for trigger in triggers:
        state = _completed(settings, state, newest)
        if not state.done and not state.filling and trigger >= state.armed_from:
            first = trigger - settings.before
            window = CaptureWindow(first, first + settings.span, trigger, triggered=True)
            state = CaptureState(trigger, window, filling=True)
    state = _completed(settings, state, newest)
    # a triggered window stays at least for its own length; without one the setting alone counts
    stays = settings.span if state.window is not None and state.window.triggered else 0
    waited = newest - state.armed_from > max(settings.auto_wait, stays)
    if settings.mode == "auto" and not state.filling and waited:
        return state._replace(window=_newest_rows(settings, newest))
    return state


def _newest_rows(settings: CaptureSettings, newest: int) -> CaptureWindow:
    return CaptureWindow(newest - settings.span, newest, newest, triggered=False)


def _completed(settings: CaptureSettings, state: CaptureState, newest: int) -> CaptureState:
    if not state.filling or state.window is None or newest < state.window.last:
        return state
    return CaptureState(state.window.last, state.window, filling=False, done=settings.mode == "single")
