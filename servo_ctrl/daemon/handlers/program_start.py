"""Starting the program of a run from where the axes are, the first time and whenever it is asked for."""

from collections.abc import Callable

from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.commands.command import CommandResult, Refusal
from servo_ctrl.commands.stage import Stage
from servo_ctrl.daemon.cycle.background_worker import BackgroundWorker
from servo_ctrl.daemon.cycle.machine import Machine
from servo_ctrl.daemon.set_points.feed_hold import FeedHold
from servo_ctrl.daemon.set_points.motion_plan import MotionPlan


class ProgramStart:
    """`on_start` is called when the program begins."""

    def __init__(self, motion: MotionPlan, worker: BackgroundWorker, on_start: Callable[[], None]) -> None:
        self._motion, self._worker, self._on_start = motion, worker, on_start
        self.preparing = False
        """It is about to begin."""
        self.problem = ""
        """Why the program did not start the last time, "" when it did."""

    def first(self, machine: Machine) -> None:
        """Start it; a program that does not fit from here stops the machine."""
        self._start(machine, lambda reason: machine.event(Event.BAD_PROGRAM, reason))

    def again(self, machine: Machine | None) -> CommandResult:
        """Start it once more; where it does not fit from here, the axes stay where they are."""
        if self._motion.empty:
            return CommandResult(
                Refusal.WRONG_STATE, "there is no program; `servo-ctrl run --program` names one"
            )
        stage = machine.stage if machine is not None else Stage.BOOTING
        if machine is None or stage is not Stage.READY or self.preparing:
            state = "about to start it" if self.preparing else stage.name.lower().replace("_", " ")
            return CommandResult(Refusal.WRONG_STATE, f"the machine is {state}, not ready")
        refused: list[str] = []

        def failed(reason: str) -> None:
            refused.append(reason)
            machine.note(f"the program was not started again: {reason}")

        self._start(machine, failed)
        return CommandResult(Refusal.OUT_OF_RANGE, refused[0]) if refused else CommandResult()

    def _start(self, machine: Machine, failed: Callable[[str], None]) -> None:
        start_m = machine.set_points_m()

        def then(program: FeedHold) -> None:
            self.preparing, self.problem = False, ""
            machine.run(program)
            self._on_start()

        def otherwise(reason: str) -> None:
            self.preparing, self.problem = False, reason
            failed(reason)

        if machine.at_a_switch:
            otherwise(machine.at_a_switch)
            return
        self.preparing = True
        self._worker.do(lambda: self._motion.prepare(start_m), then, otherwise)
