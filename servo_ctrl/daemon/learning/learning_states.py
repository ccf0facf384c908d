"""What becomes of a learning run, for everything that can happen to it: one table."""

from enum import Enum

from servo_ctrl.commands.learning_status import LearningState


class LearningEvent(Enum):
    """What happens to a learning run; the first four are asked for."""

    START = "start"
    PAUSE = "pause"
    RESUME = "resume"
    ABORT = "abort"
    STROKE_OVER = "stroke over"
    """Between two strokes."""
    LEARNED = "learned"
    """The last axis has new functions in use."""
    FAIL = "fail"
    """The machine stops, or what was learned cannot be used."""


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
"""An event that is missing cannot happen there; asked for, it is refused."""

MAKING_STROKES = frozenset({_RUNNING, LearningState.PAUSING})
"""The axes belong to learning."""


def following(state: LearningState, event: LearningEvent) -> LearningState | None:
    """Return the state after an event; None when it cannot happen in this state."""
    return TRANSITIONS[state].get(event)
