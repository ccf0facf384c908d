"""Starts the program of a run from where the axes stand: at the begin of the run and on command."""

from collections.abc import Callable, Sequence
from functools import partial

from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.commands.command import CommandResult, Refusal
from servo_ctrl.commands.objections import BEING_CHECKED, NO_PROGRAM
from servo_ctrl.commands.stage import Stage, refused, refused_now
from servo_ctrl.config.program_model import ProgramConfig
from servo_ctrl.daemon.cycle.background_worker import BackgroundWorker
from servo_ctrl.daemon.cycle.machine import MachineController
from servo_ctrl.daemon.set_points.feed_hold import FeedHold
from servo_ctrl.daemon.set_points.motion_plan import MotionPlan


class ProgramStart:
    """Plans a program in the background worker, then starts it and calls `on_start`."""

    def __init__(
        self,
        machine: MachineController,
        motion: MotionPlan,
        worker: BackgroundWorker,
        on_start: Callable[[], None],
    ) -> None:
        self._machine, self._motion, self._worker, self._on_start = machine, motion, worker, on_start
        self.preparing = False
        """Whether a program is being planned."""
        self.problem = ""
        """Why the last program did not start, else ""."""

    def start_run(self) -> None:
        """Start the program; if its motion from here is impossible, stop the machine."""
        self._start(lambda reason: self._machine.event(Event.BAD_PROGRAM, reason))

    def start_on_command(self) -> CommandResult:
        """Start the program on command; if its motion from here is impossible, leave the axes at rest."""
        if self._motion.empty:
            return refused(NO_PROGRAM)
        if self._motion.stale:
            return refused(self._motion.stale)
        if self.preparing:
            return refused(BEING_CHECKED)
        if self._machine.stage is not Stage.READY:
            return refused_now(self._machine)
        problems: list[str] = []

        def failed(reason: str) -> None:
            problems.append(reason)
            self._machine.note(f"the program was not started again: {reason}")

        self._start(failed)
        return CommandResult(Refusal.OUT_OF_RANGE, problems[0]) if problems else CommandResult()

    def start_line(self, program: ProgramConfig) -> CommandResult:
        """Start another program; the program of the run stays loaded."""
        problems: list[str] = []
        self._start(problems.append, partial(self._motion.prepare_line, program))
        return CommandResult(Refusal.OUT_OF_RANGE, problems[0]) if problems else CommandResult()

    def occupied(self) -> CommandResult | None:
        """Refuse another motion while a program is being planned."""
        return refused(BEING_CHECKED) if self.preparing else None

    def _start(
        self, failed: Callable[[str], None], prepare: Callable[[Sequence[float]], FeedHold] | None = None
    ) -> None:
        prepare = prepare or self._motion.prepare
        start_m = self._machine.set_points_m()

        def run(program: FeedHold) -> None:
            self.preparing, self.problem = False, ""
            self._machine.run(program)
            self._on_start()

        def refuse(reason: str) -> None:
            self.preparing, self.problem = False, reason
            failed(reason)

        if self._machine.at_a_switch:
            refuse(self._machine.at_a_switch)
            return
        self.preparing = True
        self._worker.do(lambda: prepare(start_m), run, refuse)
