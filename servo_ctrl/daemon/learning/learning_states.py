"""The state machine of a learning run, as one transition table."""

from enum import Enum

from servo_ctrl.commands.learning_status import LearningState


class LearningEvent(Enum):
    """Events of a learning run; the first four are commands."""

    START = "start"
    PAUSE = "pause"
    RESUME = "resume"
    ABORT = "abort"
    STROKE_OVER = "stroke over"
    """Between two strokes."""
    LEARNED = "learned"
    """The last axis has its new result in use."""
    FAIL = "fail"
    """The machine stops, or the learned result is not usable."""


_RUNNING = LearningState.RUNNING
_ENDS = {LearningEvent.ABORT: LearningState.ABORTED, LearningEvent.FAIL: LearningState.FAILED}
_BEGINS = {LearningEvent.START: _RUNNING}

TRANSITIONS: dict[LearningState, dict[LearningEvent, LearningState]] = {
    LearningState.IDLE: _BEGINS,
    _RUNNING: {
        **_ENDS,
        LearningEvent.PAUSE: LearningState.PAUSING,
        LearningEvent.STROKE_OVER: _RUNNING,
        LearningEvent.LEARNED: LearningState.DONE,
    },
    LearningState.PAUSING: {
        **_ENDS,
        LearningEvent.RESUME: _RUNNING,
        LearningEvent.STROKE_OVER: LearningState.PAUSED,
        LearningEvent.LEARNED: LearningState.DONE,
    },
    LearningState.PAUSED: {**_ENDS, LearningEvent.RESUME: _RUNNING},
    LearningState.DONE: _BEGINS,
    LearningState.ABORTED: _BEGINS,
    LearningState.FAILED: _BEGINS,
}
"""Transitions by state and event. A missing event is impossible in that state; a command is refused."""


def following(state: LearningState, event: LearningEvent) -> LearningState | None:
    """Return the state after an event; None if the event is impossible in this state."""
    return TRANSITIONS[state].get(event)
