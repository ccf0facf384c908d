"""Refuses commands for the state which the machine is in."""

from typing import Protocol

from servo_ctrl.commands.command import CommandResult, Refusal
from servo_ctrl.commands.stage import Stage


class Staged(Protocol):
    """A machine, as far as a refusal names it."""

    @property
    def stage(self) -> Stage:
        """The stage of the machine."""


def refused(reason: str) -> CommandResult:
    """Refuse a command that would be accepted in another state of the machine."""
    return CommandResult(Refusal.WRONG_STATE, reason)


def refused_now(machine: Staged | None, wanted: str = "not ready") -> CommandResult:
    """Refuse a command for the stage of the machine, None before it exists; `wanted` is the stage needed."""
    stage = machine.stage if machine is not None else Stage.BOOTING
    return refused(f"the machine is {stage.name.lower().replace('_', ' ')}, {wanted}")
