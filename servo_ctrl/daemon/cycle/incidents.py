"""Logs a machine's events and keeps their consequences: whether the run failed, why, whether it ends."""

from servo_ctrl.axis.fault_policy import ENDS_THE_RUN, REQUESTS, Event, Reaction, reaction
from servo_ctrl.commands.stage import Stage
from servo_ctrl.daemon.cycle.event_log import EventLog


class Incidents:
    """A text that was absent for `again_cycles` cycles is a new event."""

    def __init__(self, again_cycles: int) -> None:
        self.log = EventLog(again_cycles)
        self.failed = False
        """Whether an event caused a reaction that no operator or program requested."""
        self.reason = ""
        """The first event with a reaction since the machine was enabled, and a fault during its stop."""
        self.ending = False
        """Whether an event ends the run, even where a stop otherwise ends in standby."""

    def handle(self, stage: Stage, event: Event, text: str, cycle: int) -> Reaction:
        """Log an event; return the reaction of the fault policy."""
        result = reaction(stage, event)
        self.log.add(text, cycle)
        self.ending = self.ending or event in ENDS_THE_RUN
        if result is Reaction.NONE:
            return result
        fault = event not in REQUESTS and not self.failed
        if not self.reason or (stage is Stage.STANDBY and not self.failed):
            self.reason = text
        elif fault:  # a requested stop failed before the axes came to rest
            self.reason += f"; {text}"
        self.failed = self.failed or fault
        return result

    def clear(self) -> None:
        """Clear fault and reason when the machine is enabled again. The log stays."""
        self.failed, self.reason = False, ""
