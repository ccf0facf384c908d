"""What has happened to a machine: all of it noted, and what became of its run because of it."""

from servo_ctrl.axis.fault_policy import ENDS_THE_RUN, REQUESTS, Event, Reaction, reaction
from servo_ctrl.commands.stage import Stage
from servo_ctrl.daemon.cycle.event_log import EventLog


class Incidents:
    """The same text after `again_cycles` without it is another event."""

    def __init__(self, again_cycles: int) -> None:
        self.log = EventLog(again_cycles)
        self.failed = False
        """An event led to a reaction that nobody had asked for."""
        self.reason = ""
        """The first event reacted to since the machine was enabled, and a fault on the way to rest."""
        self.ending = False
        """Something happened after which the run ends, also where it stands by."""

    def take(self, stage: Stage, event: Event, text: str, cycle: int) -> Reaction:
        """Note an event; return what the fault policy says about it."""
        wanted = reaction(stage, event)
        self.log.add(text, cycle)
        self.ending = self.ending or event in ENDS_THE_RUN
        if wanted is Reaction.NONE:
            return wanted
        fault = event not in REQUESTS and not self.failed
        if not self.reason or (stage is Stage.STANDBY and not self.failed):
            self.reason = text
        elif fault:  # asked to stop, and it went wrong on the way
            self.reason += f"; {text}"
        self.failed = self.failed or fault
        return wanted

    def forget(self) -> None:
        """Begin anew, as the machine is enabled again. What was noted stays."""
        self.failed, self.reason = False, ""
