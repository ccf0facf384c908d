"""The commands of a running controller, declared once, and the results that a handler returns.

A command has a number (object 2100h), a name (in lower case the `command` of MQTT and local messages), a word
on the command line, the right that it needs, and a description. A new command needs a line here and its
handler in `servo_ctrl.daemon.handlers`.
"""

from enum import IntEnum, StrEnum
from typing import NamedTuple, Self

JOG_RENEWAL_S = 0.25
"""A jog that is not renewed for this time ramps to rest; chosen so that a few messages may be lost."""


STEP_M_S = 0.01
"""Speed of a jog step; chosen."""
LONGEST_STEP_M = 0.01
"""Bounds the distance of a jog step; chosen."""


class Right(StrEnum):
    """The right that a request needs; also the last level of its MQTT topic."""

    STOP = "stop"
    """Quick stop. Every right contains it."""
    OPERATE = "operate"
    """Switch on, move, learn, run programs, switch compensations."""
    CONFIGURE = "configure"
    """Change settings, and use another version of a learned result."""

    def permits(self, needed: "Right") -> bool:
        """Whether this right suffices for a request that needs `needed`; every right includes STOP."""
        return needed in {self, Right.STOP}


class Command(IntEnum):
    """A command: its number, its word on the command line, the right that it needs, its description."""

    word: str
    right: Right
    meaning: str

    def __new__(cls, number: int, word: str, right: Right, meaning: str) -> Self:
        """Make a member that holds its declaration besides its number."""
        command = int.__new__(cls, number)
        command._value_ = number
        command.word, command.right, command.meaning = word, right, meaning
        return command

    START_LEARNING = 1, "start-learning", Right.OPERATE, "Learn an axis, or all of them one after the other."
    ABORT_LEARNING = (
        2,
        "abort-learning",
        Right.OPERATE,
        "Ramp to rest; the functions from before stay in use.",
    )
    PAUSE_LEARNING = 3, "pause-learning", Right.OPERATE, "Pause after the stroke that is being made."
    RESUME_LEARNING = 4, "resume-learning", Right.OPERATE, "Continue after a pause."
    ENABLE_COMPENSATION = 5, "enable", Right.OPERATE, "Switch the friction compensation (the pulse) on."
    DISABLE_COMPENSATION = 6, "disable", Right.OPERATE, "Switch the friction compensation off."
    ENABLE_OBSERVER = 7, "enable-observer", Right.OPERATE, "Switch the disturbance observer on."
    DISABLE_OBSERVER = 8, "disable-observer", Right.OPERATE, "Switch the disturbance observer off."
    ROLL_BACK = 9, "roll-back", Right.CONFIGURE, "Use the version of the learned functions before this one."
    START_PROGRAM = 10, "start-program", Right.OPERATE, "Run the program once more."
    ENABLE_SCREW = 11, "enable-screw", Right.OPERATE, "Switch screw table and backlash take-up on."
    DISABLE_SCREW = 12, "disable-screw", Right.OPERATE, "Switch screw table and backlash take-up off."
    ROLL_BACK_SCREW = 13, "roll-back-screw", Right.CONFIGURE, "Use the version of the screw before this one."
    ENABLE = 14, "switch-on", Right.OPERATE, "Switch the drives on from standby; reset faults and home."
    DISABLE = 15, "switch-off", Right.OPERATE, "Come to rest, then power off."
    QUICK_STOP = 16, "quick-stop", Right.STOP, "The drives brake by themselves at once, then power off."
    HOLD_PROGRAM = 17, "hold-program", Right.OPERATE, "Feed hold: come to rest on the path."
    RESUME_PROGRAM = 18, "resume-program", Right.OPERATE, "Continue along the path after a feed hold."
    ABORT_PROGRAM = 19, "abort-program", Right.OPERATE, "Ramp to rest; the axes stay ready."
    HOME = 20, "home", Right.OPERATE, "Home the drives that have a homing method once more, from ready."
    STEP_FORWARD = 21, "step-forward", Right.OPERATE, "Move one axis by the step of 2104h:08, from ready."
    STEP_BACKWARD = 22, "step-backward", Right.OPERATE, "The same backward."
    TOUCH_OFF = 23, "touch-off", Right.OPERATE, "Here is 0 in the work offset of 2104h:09, from ready."
    CLEAR_OFFSET = 24, "clear-offset", Right.OPERATE, "Set that work offset to 0, in ready or standby."
    ENABLE_WAVEFORM = 25, "enable-waveform", Right.OPERATE, "Switch the learned waveform on."
    DISABLE_WAVEFORM = 26, "disable-waveform", Right.OPERATE, "Switch the learned waveform off."
    ROLL_BACK_WAVEFORM = (
        27,
        "roll-back-waveform",
        Right.CONFIGURE,
        "Use the version of the waveform before this one.",
    )


COMMANDS = {command.name.lower(): command for command in Command}
"""Commands by their names in MQTT and local messages."""
COMMAND_OF = {int(command): command for command in Command}
COMMAND_WORDS = {command.word: command for command in Command}
"""Commands by their words on the command line."""


class CommandRequest(NamedTuple):
    """One command; `axis` is a name of the machine file, "" = all axes."""

    command: Command
    axis: str = ""


class Refusal(IntEnum):
    """Why a request was refused."""

    NONE = 0
    UNKNOWN = 1
    """No such command, axis or setting."""
    OUT_OF_RANGE = 2
    WRONG_STATE = 3
    """Impossible now: the machine moves, is in fault, learns already, or lacks what the request needs."""
    STORAGE = 4
    """A learned result cannot be read or written."""


class CommandResult(NamedTuple):
    """The immediate answer to a request; the status shows its consequences."""

    refusal: Refusal = Refusal.NONE
    reason: str = ""
    """Text for the user; empty when accepted."""

    @property
    def accepted(self) -> bool:
        """Whether the request was accepted."""
        return self.refusal is Refusal.NONE
