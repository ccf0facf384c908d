"""Status of the learning run, with the declaration of every field."""

import math
from enum import IntEnum
from typing import NamedTuple

from servo_ctrl.commands.field import FIELDS_OF, NM, UM_S2, DataType, Entry, Field, numbered
from servo_ctrl.learning.types import Outlook

U8, U16, U32, TEXT = DataType.U8, DataType.U16, DataType.U32, DataType.TEXT


class LearningState(IntEnum):
    """State of a learning run."""

    IDLE = 0
    RUNNING = 1
    PAUSING = 2
    PAUSED = 3
    DONE = 4
    """The last run ended with a new result in use."""
    ABORTED = 5
    FAILED = 6
    """A fault, a limit or the storage ended the run; the earlier result stays in use."""


ACTIVE = frozenset({LearningState.RUNNING, LearningState.PAUSING, LearningState.PAUSED})
"""States in which a learning run exists."""
MAKING_STROKES = frozenset({LearningState.RUNNING, LearningState.PAUSING})
"""States in which learning occupies the axes."""


class LearningStatus(NamedTuple):
    """Status of the present learning run, or of the last one; see `learning.types.Outlook`."""

    state: LearningState = LearningState.IDLE
    axis: str = ""
    """The axis being learned, or learned last; "" before the first run."""
    reason: str = ""
    """Why the last run ended before its completion, else ""."""
    stage: str = ""
    """Purpose of the present stroke."""
    strokes_done: int = 0
    strokes_total: int = 0
    remaining_s: float = math.nan
    acceleration_m_s2: float = math.nan
    best_m: float = math.nan

    @property
    def planned(self) -> bool:
        """Whether the number of strokes is known."""
        return bool(self.stage or self.strokes_total)

    @property
    def progress(self) -> float:
        """Completed share of the strokes, 0 to 1."""
        return min(1.0, self.strokes_done / max(self.strokes_total, 1))

    @property
    def progress_permille(self) -> int:
        """`progress` in per mille; 1000 at the end even if fewer strokes sufficed than estimated."""
        if self.state is LearningState.DONE:
            return 1000
        return min(1000 * self.strokes_done // max(self.strokes_total, 1), 1000)


def learning_status(state: LearningState, axis: str, reason: str, outlook: Outlook | None) -> LearningStatus:
    """Return the status of a learning run; `outlook` is None while its strokes are unknown."""
    return LearningStatus(state, axis, reason, **({} if outlook is None else outlook._asdict()))


FIELDS_OF[LearningStatus] = {
    "state": Field("Learning state", Entry(0x2110, 1, U8, pdo=2), numbered(LearningState)),
    "axis": Field(
        "Axis being learned",
        Entry(0x2110, 2, U8, axis_number=True, pdo=4),
        "Or learned last; 0 = none so far.",
        null=True,
    ),
    "reason": Field("Reason of the last end of learning", Entry(0x2112, 0, TEXT), "In words."),
    "stage": Field("Learning stage", Entry(0x2111, 0, TEXT), "What the stroke is for.", part="planned"),
    "strokes_done": Field("Strokes done", Entry(0x2110, 3, U16), part="planned"),
    "strokes_total": Field("Strokes total", Entry(0x2110, 4, U16), "As expected now.", part="planned"),
    "progress": Field(part="planned", digits=4),
    "progress_permille": Field(
        "Progress in per mille", Entry(0x2110, 7, U16, pdo=5), "1000 when done.", mqtt=None, local=False
    ),
    "remaining_s": Field(
        "Remaining time in s",
        Entry(0x2110, 5, U32, 1.0, none=0),
        "Machine time, as expected now.",
        part="planned",
    ),
    "acceleration_m_s2": Field(
        "Reverse acceleration in um per s2",
        Entry(0x2110, 8, U32, UM_S2),
        "Of the stroke that is being made.",
        part="planned",
    ),
    "best_m": Field(
        "Best J in nm",
        Entry(0x2110, 6, U32, NM),
        "Least J so far at the acceleration of sub 8.",
        part="planned",
    ),
}
