"""What an operator asks of the program: start, feed hold, abort, and another one in its place."""

from __future__ import annotations

from typing import TYPE_CHECKING

from servo_ctrl.axis.fault_policy import Stage
from servo_ctrl.config.desk import Command, ProgramStatus, Refusal, Verdict

if TYPE_CHECKING:
    from collections.abc import Callable

    from servo_ctrl.config.program_model import ProgramConfig
    from servo_ctrl.daemon.announcer import Announcer
    from servo_ctrl.daemon.learning_job import LearningJob
    from servo_ctrl.daemon.machine import Machine
    from servo_ctrl.daemon.motion_plan import CheckedProgram, MotionPlan
    from servo_ctrl.daemon.program_start import ProgramStart
    from servo_ctrl.daemon.workshop import Workshop

_ACCEPTED = Verdict()


class ProgramDesk:
    """`commands` are carried out for all axes, whatever axis they name."""

    def __init__(
        self,
        motion: MotionPlan,
        job: LearningJob,
        program: ProgramStart,
        workshop: Workshop,
        announcer: Announcer,
    ) -> None:
        self._motion, self._job, self._program = motion, job, program
        self._workshop, self._announcer = workshop, announcer
        self._machine: Machine | None = None
        self._loading = False
        self._problem = ""
        """Why the last program that was to be loaded was not."""
        self.commands: dict[Command, Callable[[str], Verdict]] = {
            Command.START_PROGRAM: lambda _axis: self._start(),
            Command.HOLD_PROGRAM: lambda _axis: self._hold(),
            Command.RESUME_PROGRAM: lambda _axis: self._resume(),
            Command.ABORT_PROGRAM: lambda _axis: self._abort(),
        }

    def attach(self, machine: Machine) -> None:
        """The machine is there."""
        self._machine = machine

    def load(self, program: ProgramConfig) -> Verdict:
        """Check a program in the workshop and put it in the place of the run's."""
        machine = self._machine
        if problem := self.occupied():
            return problem
        if machine is None or machine.stage not in {Stage.READY, Stage.STANDBY}:
            return not_now(self._machine, "neither ready nor in standby")
        start_m = machine.set_points_m() if machine.stage is Stage.READY else None
        refused: list[str] = []

        def loaded(checked: CheckedProgram) -> None:
            self._loading, self._problem = False, ""
            self._program.problem = ""
            self._motion.replace(checked)
            self._announcer.changed()

        def failed(reason: str) -> None:
            self._loading, self._problem = False, reason
            refused.append(reason)
            self._announcer.changed()

        self._loading = True
        self._workshop.do(lambda: self._motion.check(program, start_m), loaded, failed)
        return Verdict(Refusal.OUT_OF_RANGE, refused[0]) if refused else _ACCEPTED

    def status(self) -> ProgramStatus:
        """The program and how far it is."""
        motion, current = self._motion, self._motion.current
        step, label = -1, ""
        running = self._machine is not None and self._machine.follows(current)
        if running and current is not None and current.spans:
            span = current.spans[-1]
            step, label = span.step - motion.first_step, span.label
        return ProgramStatus(
            name=motion.name,
            step=step,
            label=label,
            progress=motion.progress,
            held=running and current is not None and current.held,
            loaded=not motion.empty,
            preparing=self._loading or self._program.preparing,
            problem=self._problem or self._program.problem,
        )

    def occupied(self) -> Verdict | None:
        """What is about to move the axes, or to say what moves them."""
        if learning := self._learning_first():
            return learning
        if self._program.preparing:
            return refused("the program is about to start; wait for its end")
        if self._loading:
            return refused("a program is being checked; wait for its end")
        return None

    def _start(self) -> Verdict:
        if self._loading:
            return refused("a program is being checked; wait for its end")
        if self._machine is not None and self._machine.follows(self._motion.current) and self._held:
            return refused("the program is held; resume it, or abort it first")
        self._problem = ""
        return self._learning_first() or self._program.again(self._machine)

    @property
    def _held(self) -> bool:
        return self._motion.current is not None and self._motion.current.held

    def _hold(self) -> Verdict:
        current = self._motion.current
        if problem := self._learning_first() or self._without_program():
            return problem
        if current is None or self._held:
            return refused("the program is held already")
        current.hold()
        self._announcer.changed()
        return _ACCEPTED

    def _resume(self) -> Verdict:
        current = self._motion.current
        if problem := self._learning_first() or self._without_program():
            return problem
        if current is None or not self._held:
            return refused("the program is not held")
        current.resume()
        self._announcer.changed()
        return _ACCEPTED

    def _abort(self) -> Verdict:
        machine = self._machine
        if problem := self._learning_first():
            return problem
        if machine is None or not machine.follows(machine.program):
            return refused("no program is running")
        machine.interrupt()
        self._announcer.changed()
        return _ACCEPTED

    def _without_program(self) -> Verdict | None:
        if self._machine is not None and self._machine.follows(self._motion.current):
            return None
        return refused("no program is running")

    def _learning_first(self) -> Verdict | None:
        if not self._job.has_the_axes:
            return None
        return refused("an axis is learning; pause or abort it first")


def refused(reason: str) -> Verdict:
    """Not in the present state."""
    return Verdict(Refusal.WRONG_STATE, reason)


def not_now(machine: Machine | None, wanted: str = "not ready") -> Verdict:
    """Refused for the stage that the machine is in."""
    stage = machine.stage if machine is not None else Stage.BOOTING
    return refused(f"the machine is {stage.name.lower().replace('_', ' ')}, {wanted}")
