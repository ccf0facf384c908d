"""Learning in two strokes, so that a run of a second can be interrupted anywhere in it, to the last write.

Everything else of it is as ever: strokes, journal, store. Two versions of an earlier run are there already.
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


def result(strokes: int) -> Learned:
    """Functions that tell by their number of strokes which they are."""
    durations, amplitudes = (tuple((a, value) for a in POINTS) for value in (0.05, 0.001))
    return Learned("fast", durations, amplitudes, 0.0, (), 5e-6, 1e-6, strokes, 1.0)


class TwoStrokes:
    """In the place of `servo_ctrl.learning.schedule.LearningRun`."""

    def __init__(self, _settings: LearningSettings) -> None:
        self._done = 0

    @property
    def stroke(self) -> Stroke | None:
        """The next one."""
        return STROKES[self._done] if self._done < len(STROKES) else None

    def take(self, _result: StrokeResult) -> None:
        """It was made."""
        self._done += 1

    @property
    def outlook(self) -> Outlook:
        """How far it is."""
        stage = "check" if self.stroke is not None else "done"
        return Outlook(stage, self._done, len(STROKES), 1.0, 0.7, 1e-6)

    @property
    def learned(self) -> Learned | None:
        """What came of it."""
        return None if self.stroke is not None else result(NEW_STROKES)


EARLIER = (61, 62)
"""Strokes of the two versions that are there."""


def store_earlier(machine: MachineConfig, directory: Path) -> None:
    """What every run finds."""
    store = LearnedStore(directory, machine)
    for axis in machine.axes:
        for strokes in EARLIER:
            store.add(axis, result(strokes), {})


def known(learned: Learned) -> bool:
    """Whether this is a result as it was stored, whole."""
    return any(learned == result(strokes) for strokes in (*EARLIER, NEW_STROKES))
