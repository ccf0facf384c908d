"""What has happened to a machine: all of it noted, and what became of its run because of it."""

from collections.abc import Callable

from servo_ctrl.axis.fault_policy import ENDS_THE_RUN, WISHES, Event, Reaction, reaction
from servo_ctrl.commands.stage import Stage
from servo_ctrl.daemon.cycle.event_log import EventLog


class Incidents:
    """`on_fault` is called for the first event that is reacted to and was not asked for.

    The same words after `again_cycles` of silence are another event.
    """

    def __init__(self, again_cycles: int, on_fault: Callable[[Event, str], None]) -> None:
        self.log = EventLog(again_cycles)
        self.failed = False
        self.reason = ""
        """The first event reacted to since the machine was enabled, and a fault on the way to rest."""
        self.ending = False
        """Something happened after which the run ends, also where it stands by."""
        self._on_fault = on_fault

    def take(self, stage: Stage, event: Event, text: str, cycle: int) -> Reaction:
        """What the fault policy says about an event."""
        wanted = reaction(stage, event)
        self.log.add(text, cycle)
        self.ending = self.ending or event in ENDS_THE_RUN
        if wanted is Reaction.NONE:
            return wanted
        fault = event not in WISHES and not self.failed
        if not self.reason or (stage is Stage.STANDBY and not self.failed):
            self.reason = text
        elif fault:  # asked to stop, and it went wrong on the way
            self.reason += f"; {text}"
        if fault:
            self.failed = True
            self._on_fault(event, text)
        return wanted

    def forget(self) -> None:
        """The machine is enabled again. What was noted stays."""
        self.failed, self.reason = False, ""
