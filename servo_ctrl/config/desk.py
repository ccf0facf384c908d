"""What can be asked of a running controller, and what it tells: the same over SDO, MQTT and the command line.

The daemon has the one `Desk`; whoever brings a request (our CANopen node, the MQTT client) knows only this.
Lengths in metres, as everywhere inside.
"""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:
    from servo_ctrl.learning.screw import ScrewLearned
    from servo_ctrl.learning.types import Learned, Outlook, ReversalReport

LEARNERS = ("fast", "paper", "screw")
"""By the value of Setting.LEARNER; the first two learn the friction pulse."""


class Command(IntEnum):
    """Value of object 2100h, and in lower case the `command` of an MQTT message."""

    START_LEARNING = 1
    ABORT_LEARNING = 2
    PAUSE_LEARNING = 3
    """After the stroke that is being made."""
    RESUME_LEARNING = 4
    ENABLE_COMPENSATION = 5
    DISABLE_COMPENSATION = 6
    ENABLE_OBSERVER = 7
    DISABLE_OBSERVER = 8
    ROLL_BACK = 9
    """To the version before the one in use."""
    START_PROGRAM = 10
    """Run the program of the command line once more."""
    ENABLE_SCREW = 11
    """Screw table and backlash take-up."""
    DISABLE_SCREW = 12
    ROLL_BACK_SCREW = 13
    """To the version of the learned screw before the one in use."""


class Setting(IntEnum):
    """What can be changed while the controller runs; not written back to the machine file."""

    REQUIRED_M = 1
    """J_required, metres, 1e-9 to 1e-2."""
    LEARNER = 2
    """0 = fast, 1 = paper, 2 = screw."""
    ADAPTATION = 3
    """0 = off, 1 = on."""


class Request(NamedTuple):
    """One command; `axis` is a name of the machine file, "" = all axes."""

    command: Command
    axis: str = ""


class Refusal(IntEnum):
    """Why a request was not carried out."""

    NONE = 0
    UNKNOWN = 1
    """No such command, axis or setting."""
    OUT_OF_RANGE = 2
    WRONG_STATE = 3
    """Not now: the machine moves, is in fault, learns already, or has nothing to do it with."""
    STORAGE = 4
    """A learned result cannot be read or written."""


class Verdict(NamedTuple):
    """The answer to a request, at once; what follows from it shows in the status."""

    refusal: Refusal = Refusal.NONE
    reason: str = ""
    """In words; empty when accepted."""

    @property
    def accepted(self) -> bool:
        """The request is being carried out."""
        return self.refusal is Refusal.NONE


class LearningState(IntEnum):
    """Object 2110h sub 1."""

    IDLE = 0
    RUNNING = 1
    PAUSING = 2
    PAUSED = 3
    DONE = 4
    """The last run ended with new functions in use."""
    ABORTED = 5
    FAILED = 6
    """A fault, a limit or the storage ended it; the functions from before are in use."""


class LearningStatus(NamedTuple):
    """Of the learning run that is going on, or of the last one."""

    state: LearningState
    axis: str
    """The axis that is being learned; "" before the first run."""
    outlook: Outlook | None
    reason: str
    """Why the last run ended as it did, in words."""


class ScrewStatus(NamedTuple):
    """Screw compensation of one axis."""

    enabled: bool = False
    version: int = 0
    """Of the learned screw in use, 0 = none."""
    learned_at: str = ""
    """Date of that version, ISO 8601, "" without one."""
    learned: ScrewLearned | None = None


class AxisStatus(NamedTuple):
    """Compensation of one axis."""

    name: str
    compensation_enabled: bool
    observer_enabled: bool
    learning_due: bool
    reversals: int
    """Evaluated since the start."""
    last: ReversalReport | None
    version: int
    """Of the learned functions in use, 0 = none."""
    learned_at: str
    """Date of that version, ISO 8601, "" without one."""
    learned: Learned | None
    screw: ScrewStatus = ScrewStatus()


class DeskStatus(NamedTuple):
    """Everything readable."""

    stage: int
    """`axis.fault_policy.Stage`."""
    cycles: int
    """SYNC cycles so far."""
    missed_ticks: int
    learning: LearningStatus
    axes: tuple[AxisStatus, ...]
    settings: dict[Setting, float]


class Desk(Protocol):
    """Where requests arrive. All calls are made in the thread of the cycle and return at once."""

    def execute(self, request: Request) -> Verdict:
        """Carry out a command, or say why not."""

    def change(self, setting: Setting, value: float) -> Verdict:
        """Change a setting, or say why not."""

    def status(self) -> DeskStatus:
        """What there is to know now."""
