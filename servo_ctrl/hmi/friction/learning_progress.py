"""The state of a learning run as texts, and which of its commands are possible."""

import math
from typing import NamedTuple

from servo_ctrl.commands.learning_status import ACTIVE, LearningState, LearningStatus
from servo_ctrl.hmi.shell.units import UnitSystem, duration_text

STAGES = {
    "interval": "finding the range of accelerations",
    "duration": "duration of the pulse",
    "coarse": "amplitude, coarse",
    "fine": "amplitude, fine",
    "search": "searching the pulse",
    "trailing": "second trapezoid",
    "travel": "travelling along the screw",
    "check": "checking what was learned",
}
"""What a stroke is for, by the names of `learning.types.Stroke`."""


class LearningProgress(NamedTuple):
    """A learning run in texts; "" where there is nothing to say."""

    headline: str
    share: float
    """Progress, 0 to 1."""
    stage: str
    strokes: str
    remaining: str
    best: str
    reason: str


def learning_progress(learning: LearningStatus, units: UnitSystem) -> LearningProgress:
    """The progress of the learning run, or how the last one ended."""
    best = ""
    if math.isfinite(learning.best_m):
        best = units.error.with_unit(learning.best_m)
        if math.isfinite(learning.acceleration_m_s2):
            best += f" at {units.acceleration.with_unit(learning.acceleration_m_s2)}"
    return LearningProgress(
        headline=f"Axis {learning.axis}: {learning.state.name.lower()}"
        if learning.axis
        else "No learning run yet.",
        share=min(max(learning.progress, 0.0), 1.0),
        stage=STAGES.get(learning.stage, learning.stage),
        strokes=f"{learning.strokes_done} of {learning.strokes_total}" if learning.strokes_total else "",
        remaining=duration_text(learning.remaining_s) if learning.state in ACTIVE else "",
        best=best,
        reason=learning.reason,
    )


def possible_commands(learning: LearningStatus) -> dict[str, bool]:
    """Whether each command of learning is possible now; the controller decides in the end."""
    state = learning.state
    return {
        "start_learning": state not in ACTIVE,
        "pause_learning": state is LearningState.RUNNING,
        "resume_learning": state in {LearningState.PAUSED, LearningState.PAUSING},
        "abort_learning": state in ACTIVE,
    }
