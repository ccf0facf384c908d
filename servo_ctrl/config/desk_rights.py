"""Who may ask for what of a running controller: one table, for MQTT's topics and the page's roles alike."""

from __future__ import annotations

from enum import StrEnum

from servo_ctrl.config.desk import Command


class Right(StrEnum):
    """The right that a request needs; also the last level of the MQTT topic for it."""

    STOP = "stop"
    """A quick stop. Whoever may anything may stop."""
    OPERATE = "operate"
    """Switch on, move, learn, run programs, switch compensations."""
    CONFIGURE = "configure"
    """Change settings, and take another version of what was learned."""


NEEDED = dict.fromkeys(Command, Right.OPERATE) | {
    Command.QUICK_STOP: Right.STOP,
    Command.ROLL_BACK: Right.CONFIGURE,
    Command.ROLL_BACK_SCREW: Right.CONFIGURE,
}
"""By command; a setting needs CONFIGURE."""


def needed_for(command: Command | None) -> Right:
    """What a command needs; None: a setting."""
    return Right.CONFIGURE if command is None else NEEDED[command]


def permits(right: Right, needed: Right) -> bool:
    """Each right is for its own requests and for a stop; who needs two is given two."""
    return needed in {right, Right.STOP}
