"""Learning in two strokes, so that a fault can interrupt a short run at any write.

Strokes, journal and store are the real ones. The store already has two versions of an earlier run.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from servo_ctrl.learned.store import LearnedStore
from servo_ctrl.learning.types import NO_PULSE, Learned, Outlook, Pulse, Stroke

if TYPE_CHECKING:
    from pathlib import Path

    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.learning.types import LearningSettings, StrokeResult

POINTS = (0.5, 0.7)
"""Accelerations, m/s^2."""
STROKES = (Stroke("check", 0.7, NO_PULSE), Stroke("check", 0.7, Pulse(0.05, 0.001)))
NEW_STROKES = len(STROKES)


def learned_result(strokes: int) -> Learned:
    """Return learned functions that are identified by their number of strokes."""
    durations, amplitudes = (tuple((a, value) for a in POINTS) for value in (0.05, 0.001))
    return Learned("fast", durations, amplitudes, 0.0, (), 5e-6, 1e-6, strokes, 1.0)


class TwoStrokes:
    """Replaces `servo_ctrl.learning.schedule.LearningRun`."""

    def __init__(self, _settings: LearningSettings) -> None:
        self._done = 0

    @property
    def stroke(self) -> Stroke | None:
        """The next stroke; None when learning is complete."""
        return STROKES[self._done] if self._done < len(STROKES) else None

    def take(self, _result: StrokeResult) -> None:
        """Take the result of `stroke`."""
        self._done += 1

    @property
    def outlook(self) -> Outlook:
        """Progress of the run."""
        stage = "check" if self.stroke is not None else "done"
        return Outlook(stage, self._done, len(STROKES), 1.0, 0.7, 1e-6)

    @property
    def learned(self) -> Learned | None:
        """The learned functions; None before the last stroke."""
        return None if self.stroke is not None else learned_result(NEW_STROKES)


STORED_STROKES = (61, 62)
"""Numbers of strokes of the two stored versions."""


def store_earlier(machine: MachineConfig, directory: Path) -> None:
    """Store the two versions with which every run begins."""
    store = LearnedStore(directory, machine)
    for axis in machine.axes:
        for strokes in STORED_STROKES:
            store.add(axis, learned_result(strokes), {})


def is_stored_result(learned: Learned) -> bool:
    """Return whether this is one of the stored results, complete."""
    return any(learned == learned_result(strokes) for strokes in (*STORED_STROKES, NEW_STROKES))
