"""Stages of the machine: the states of `axis.fault_policy`, object 2000h, and why a command is refused."""

from enum import IntEnum
from typing import Protocol

from servo_ctrl.commands.command import CommandResult, Refusal


class Stage(IntEnum):
    """What the machine as a whole is doing; the controller's object 2000h."""

    BOOTING = 0
    STARTING = 1
    """Drives are switched on and homed; the drives move the axes, not we."""
    READY = 2
    RUNNING = 3
    STOPPING = 4
    """Controlled stop: our references ramp down, all axes in the same time."""
    QUICK_STOPPING = 5
    """The drives brake by themselves (605Ah, 6085h)."""
    DISABLING = 6
    OFF = 7
    STANDBY = 8
    """Off, and the cycle goes on: until ENABLE, or a signal."""

    @property
    def words(self) -> str:
        """Its name in words, as "quick stopping"."""
        return self.name.lower().replace("_", " ")

    @property
    def under_way(self) -> bool:
        """The drives are on or being switched on, and nothing has stopped the machine."""
        return Stage.STARTING <= self <= Stage.RUNNING

    @property
    def stopped(self) -> bool:
        """The machine stops or has stopped, so that its status gives a reason where there is one."""
        return self >= Stage.STOPPING

    @property
    def decelerating(self) -> bool:
        """The axes are being brought to rest, by our references or by the drives."""
        return self in {Stage.STOPPING, Stage.QUICK_STOPPING}


class Staged(Protocol):
    """A machine, as far as a refusal names it."""

    @property
    def stage(self) -> Stage:
        """The stage of the machine."""


def refused(reason: str) -> CommandResult:
    """Refuse a command that would be accepted in another state of the machine."""
    return CommandResult(Refusal.WRONG_STATE, reason)


def refused_now(machine: Staged, wanted: str = "not ready") -> CommandResult:
    """Refuse a command for the stage of the machine; `wanted` is the stage needed."""
    return refused(f"the machine is {machine.stage.words}, {wanted}")
