"""What can be asked of a running controller, and what it tells: the same over SDO, MQTT and the command line.

The daemon has the one `Desk`; whoever brings a request (our CANopen node, the MQTT client) knows only this.
Lengths in metres, as everywhere inside.
"""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:
    from servo_ctrl.config.program_model import ProgramConfig
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
    ENABLE = 14
    """Switch the drives on from standby; resets faults and homes."""
    DISABLE = 15
    """Come to rest, then power off."""
    QUICK_STOP = 16
    """The drives brake by themselves, at once, then power off."""
    HOLD_PROGRAM = 17
    """Feed hold: to rest on the path."""
    RESUME_PROGRAM = 18
    """On along the path after a feed hold."""
    ABORT_PROGRAM = 19
    """Ramp to rest; the axes stay ready."""
    HOME = 20
    """Home the drives that have a homing method anew, from ready."""


COMMANDS = {command.name.lower(): command for command in Command}
"""By their names in messages."""
JOG_RENEWAL_S = 0.25
"""So long a jog goes on without being renewed."""


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


class DriveStatus(NamedTuple):
    """The drive of one axis, as it was heard last."""

    axis: str
    phase: str
    """Where its sequence is: a value of `axis.drive.Phase`, as "servo", "off" or "lost"."""
    state: str
    """Of the power stage, CiA 402, as "operation enabled"; a value of `canopen.cia402.DriveState`, or "not
    heard" where its inputs do not come any more."""
    statusword: int
    error_code: int | None
    """Of its last emergency message that was no reset, since it was enabled; None without one."""
    homed: bool
    """Its homing has come to its end in this run; False also where it has no homing method."""
    position_m: float
    """Motor position at the table, relative to home; NaN when it did not come."""
    ready: bool
    """Our loop leads the axis."""
    limits_m: tuple[float, float]
    """Of the travel (`limits.position_mm`), lowest and highest."""


class ProgramStatus(NamedTuple):
    """The program of the run and how far it is."""

    name: str = ""
    """Its file, without the directory."""
    step: int = -1
    """Of the program, from 0; -1 while it does not run."""
    label: str = ""
    """Of that step."""
    progress: float = 0.0
    """Share of its time that was run, the last time, 0 to 1; a hold does not count."""
    held: bool = False
    """A feed hold was asked for: the axes come to rest on the path, or rest there."""
    loaded: bool = False
    """There is a program that can be started."""
    preparing: bool = False
    """One is being checked, or is about to start."""
    problem: str = ""
    """Why the last one that was to be loaded or started was not; "" when it was."""


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
    reason: str = ""
    """Why the machine is stopping, in standby or off; "" while nothing stopped it."""
    drives: tuple[DriveStatus, ...] = ()
    program: ProgramStatus = ProgramStatus()


class Desk(Protocol):
    """Where requests arrive. All calls are made in the thread of the cycle and return at once."""

    def execute(self, request: Request) -> Verdict:
        """Carry out a command, or say why not."""

    def change(self, setting: Setting, value: float) -> Verdict:
        """Change a setting, or say why not."""

    def jog(self, axis: str, velocity_m_s: float) -> Verdict:
        """Move an axis at this velocity until `JOG_RENEWAL_S` has gone by without another call; 0 stops it.

        Within the acceleration limit and the travel. Several axes may jog at once.
        """

    def load_program(self, program: ProgramConfig) -> Verdict:
        """Check a program and put it in the place of the run's; whether it was shows in the status."""

    def status(self) -> DeskStatus:
        """What there is to know now."""
