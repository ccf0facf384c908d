"""Executes commands for the program: load, start, feed hold, resume, abort, and single lines of G-code."""

from collections.abc import Callable
from typing import Any

from servo_ctrl.commands.command import Command, CommandResult, Refusal
from servo_ctrl.commands.machine_status import ProgramStatus
from servo_ctrl.commands.objections import (
    BEING_CHECKED,
    HELD,
    HELD_ALREADY,
    NOT_AT_REST,
    NOT_HELD,
    NOT_RUNNING,
)
from servo_ctrl.commands.stage import Stage, refused, refused_now
from servo_ctrl.commands.status_publisher import StatusPublisher
from servo_ctrl.config.part_program import PartProgram
from servo_ctrl.config.program_model import ProgramConfig
from servo_ctrl.daemon.cycle.background_worker import BackgroundWorker
from servo_ctrl.daemon.cycle.machine import MachineController
from servo_ctrl.daemon.handlers.program_start import ProgramStart
from servo_ctrl.daemon.handlers.work_offsets import WorkOffsets
from servo_ctrl.daemon.learning.learning_job import LearningJob
from servo_ctrl.daemon.set_points.motion_plan import CheckedProgram, MotionPlan
from servo_ctrl.motion.gcode.path_builder import Modes

_ACCEPTED = CommandResult()


class ProgramCommands:
    """`commands` apply to all axes, whatever axis they name."""

    def __init__(
        self,
        machine: MachineController,
        motion: MotionPlan,
        *,
        job: LearningJob,
        program: ProgramStart,
        worker: BackgroundWorker,
        publisher: StatusPublisher,
        offsets: WorkOffsets,
    ) -> None:
        self.offsets = offsets
        """The work offsets for reading part programs."""
        self.modes = Modes()
        """The modal words set by single lines of G-code."""
        self.setters: dict[str, Callable[[Any], None]] = {
            "feed_override_percent": motion.pace.set_feed,
            "rapid_override_percent": motion.pace.set_rapid,
            "single_block": lambda on: motion.set_single_block(single_block=on),
            "optional_stop": lambda on: motion.set_optional_stop(on=on),
            "work_offset": offsets.choose,
        }
        """The setter of each setting that affects programs."""
        self._machine, self._motion, self._job, self._program = machine, motion, job, program
        self._worker, self._publisher = worker, publisher
        self._loading = False
        self._problem = ""
        """Why the last program could not be loaded, else ""."""
        self.commands: dict[Command, Callable[[str], CommandResult]] = {
            Command.START_PROGRAM: lambda _axis: self._start(),
            Command.HOLD_PROGRAM: lambda _axis: self._hold(hold=True),
            Command.RESUME_PROGRAM: lambda _axis: self._hold(hold=False),
            Command.ABORT_PROGRAM: lambda _axis: self._abort(),
        }

    def load(self, program: ProgramConfig) -> CommandResult:
        """Check a program in the background worker and make it the program of the run."""
        machine = self._machine
        if problem := self.occupied():
            return problem
        if machine.stage not in {Stage.READY, Stage.STANDBY}:
            return refused_now(machine, NOT_AT_REST)
        start_m = machine.set_points_m() if machine.stage is Stage.READY else None
        problems: list[str] = []

        def loaded(checked: CheckedProgram) -> None:
            self._loading, self._problem = False, ""
            self._program.problem = ""
            self._motion.replace(checked)
            self._publisher.changed()

        def failed(reason: str) -> None:
            self._loading, self._problem = False, reason
            problems.append(reason)
            self._publisher.changed()

        self._loading = True
        self._worker.do(lambda: self._motion.check(program, start_m), loaded, failed)
        return CommandResult(Refusal.OUT_OF_RANGE, problems[0]) if problems else _ACCEPTED

    def run_line(self, program: PartProgram) -> CommandResult:
        """Run a line of G-code from where the axes stand; the program of the run stays loaded."""
        machine = self._machine
        if problem := self.occupied():
            return problem
        if machine.stage is not Stage.READY:
            return refused_now(machine)
        if program.start_m != machine.set_points_m():
            return refused("the axes have moved while the line was read; send it again")
        self._problem = ""
        verdict = self._program.start_line(program) if program.motion else _ACCEPTED
        if verdict.accepted and program.modes is not None:
            self.modes, self.offsets.chosen = program.modes, program.modes.work_offset
        return verdict

    def status(self) -> ProgramStatus:
        """Return the name, state and progress of the program."""
        motion, current = self._motion, self._motion.current
        step, label, line = -1, "", 0
        running = self._machine.follows(current)
        if running and current is not None and current.spans:
            span, block = current.spans[-1], current.block
            step, label = span.step - motion.first_step, span.label
            line = block.line if block is not None else 0
        return ProgramStatus(
            name=motion.name,
            step=step,
            label=label,
            progress=motion.progress,
            held=running and current is not None and current.holding,
            loaded=not motion.empty,
            preparing=self._loading or self._program.preparing,
            problem=self._problem or self._program.problem,
            line=line,
            held_by=current.held_by if running and current is not None else "",
            apart=motion.runs_line,
            entry=motion.entry,
            modes=self.modes.words,
            offsets_m=self.offsets.status(),
        )

    def occupied(self) -> CommandResult | None:
        """Refuse another motion while learning or a program occupies the axes."""
        return self._job.occupied() or self._program.occupied() or self._being_loaded()

    def _being_loaded(self) -> CommandResult | None:
        return refused(BEING_CHECKED) if self._loading else None

    def _start(self) -> CommandResult:
        if problem := self._being_loaded():
            return problem
        current = self._motion.current
        if current is not None and current.holding and self._machine.follows(current):
            return refused(HELD)
        self._problem = ""
        return self._job.occupied() or self._program.start_on_command()

    def _hold(self, *, hold: bool) -> CommandResult:
        """Hold the program on its path, or resume it."""
        current = self._motion.current
        if problem := self._job.occupied():
            return problem
        if current is None or not self._machine.follows(current):
            return refused(NOT_RUNNING)
        if current.holding == hold:
            return refused(HELD_ALREADY if hold else NOT_HELD)
        current.hold(hold=hold)
        self._publisher.changed()
        return _ACCEPTED

    def _abort(self) -> CommandResult:
        if problem := self._job.occupied():
            return problem
        if not self._machine.follows(self._machine.program):
            return refused(NOT_RUNNING)
        self._machine.interrupt()
        self._publisher.changed()
        return _ACCEPTED
