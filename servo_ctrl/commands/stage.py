"""Stages of the machine: the states of `axis.fault_policy`, object 2000h, and why a command is refused."""

from enum import IntEnum
from typing import Protocol

from servo_ctrl.commands.command import CommandResult, Refusal


class Stage(IntEnum):
    """State of the machine as a whole; the controller's object 2000h."""

    BOOTING = 0
    STARTING = 1
    """Drives are switched on and homed; the drives generate any motion, not the controller."""
    READY = 2
    RUNNING = 3
    STOPPING = 4
    """Controlled stop: the controller's set points ramp down, all axes in the same time."""
    QUICK_STOPPING = 5
    """The drives brake by themselves (605Ah, 6085h)."""
    DISABLING = 6
    OFF = 7
    STANDBY = 8
    """Drives without power while the cycle continues, until ENABLE or a signal."""

    @property
    def words(self) -> str:
        """The name as text, such as "quick stopping"."""
        return self.name.lower().replace("_", " ")

    @property
    def under_way(self) -> bool:
        """Whether the drives are on or being switched on, and nothing has stopped the machine."""
        return Stage.STARTING <= self <= Stage.RUNNING

    @property
    def stopped(self) -> bool:
        """Whether the machine stops or has stopped, so that its status may hold a reason."""
        return self >= Stage.STOPPING


class Staged(Protocol):
    """A machine with a stage, which a refusal names."""

    @property
    def stage(self) -> Stage:
        """The stage of the machine."""


def refused(reason: str) -> CommandResult:
    """Refuse a command that another state of the machine would permit."""
    return CommandResult(Refusal.WRONG_STATE, reason)


def refused_now(machine: Staged, wanted: str = "not ready") -> CommandResult:
    """Refuse a command because of the machine's stage; `wanted` names the stage needed."""
    return refused(f"the machine is {machine.stage.words}, {wanted}")
