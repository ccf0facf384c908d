"""Executes commands from SDO, MQTT and the local socket, and composes the status that they publish."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, TypeVar

from servo_ctrl.commands.axis_status import AxisStatus
from servo_ctrl.commands.command import Command, CommandRequest, CommandResult, Refusal
from servo_ctrl.commands.learned_status import ScrewStatus, WaveformStatus
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.commands.settings import SETTINGS, Settings
from servo_ctrl.commands.status_publisher import StatusPublisher
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.part_program import PartProgram, ReadingOptions
from servo_ctrl.config.program_model import ProgramConfig
from servo_ctrl.control.compensation.learned_waveform import LearnedWaveformSettings
from servo_ctrl.daemon.cycle.machine import MachineController
from servo_ctrl.daemon.handlers.compensation_commands import PULSE, CompensationCommands
from servo_ctrl.daemon.handlers.compensation_commands import SCREW as SCREW_SECTION
from servo_ctrl.daemon.handlers.compensation_commands import WAVEFORM as WAVEFORM_SECTION
from servo_ctrl.daemon.handlers.operating_commands import OperatingCommands
from servo_ctrl.daemon.handlers.program_commands import ProgramCommands
from servo_ctrl.daemon.handlers.program_start import ProgramStart
from servo_ctrl.daemon.learning.adaptation import Adaptation
from servo_ctrl.daemon.learning.learning_job import LearningJob
from servo_ctrl.daemon.learning.monitoring import ReversalMonitor
from servo_ctrl.daemon.learning.pulse_compensation import AxisCompensation
from servo_ctrl.daemon.learning.screw_compensation import ScrewCompensation
from servo_ctrl.daemon.learning.waveform_compensation import WaveformCompensation
from servo_ctrl.daemon.set_points.motion_plan import MotionPlan
from servo_ctrl.learning.screw import LEARNER as SCREW
from servo_ctrl.learning.waveform_stroke import LEARNER as WAVEFORM

Status = TypeVar("Status", ScrewStatus, WaveformStatus)
_ACCEPTED = CommandResult()


class ControllerCommandHandler:
    """Implements `commands.handler.CommandHandler`."""

    def __init__(
        self,
        config: MachineConfig,
        machine: MachineController,
        motion: MotionPlan,
        *,
        compensation: CompensationCommands,
        publisher: StatusPublisher,
        job: LearningJob,
        monitor: ReversalMonitor,
        adaptation: Adaptation,
        program: ProgramStart,
        programs: ProgramCommands,
        operating: OperatingCommands,
    ) -> None:
        self._machine, self._motion = machine, motion
        self._compensation, self._publisher = compensation, publisher
        self._job, self._monitor, self._adaptation = job, monitor, adaptation
        self._program, self._programs, self._operating = program, programs, operating
        self._learner = config.learning.learner
        self._beyond_limits = {
            PULSE: motion.strokes_beyond_limits(),
            SCREW_SECTION: motion.travels_beyond_limits(),
            WAVEFORM_SECTION: motion.strokes_beyond_limits(LearnedWaveformSettings),
        }
        """By section: the axes whose learning motions would leave the limits, and why."""
        self._setters: dict[str, Callable[[Any], None]] = {
            "required_m": self._set_required,
            "learner": self._set_learner,
            "adaptation": lambda on: adaptation.switch(on=on),
            **programs.setters,
            "step_m": operating.set_step,
        }
        """The setter of each field of `Settings`."""
        self._commands: dict[Command, Callable[[str], CommandResult]] = {
            Command.START_LEARNING: self._start_learning,
            Command.ABORT_LEARNING: lambda _axis: job.abort(),
            Command.PAUSE_LEARNING: lambda _axis: job.pause(),
            Command.RESUME_LEARNING: lambda _axis: program.occupied() or job.resume(),
            **programs.commands,
            **operating.commands,
            **compensation.commands,
            **{command: partial(self._roll_back, roll) for command, roll in compensation.roll_backs.items()},
        }

    def execute(self, request: CommandRequest) -> CommandResult:
        """Execute a command, or refuse it with a reason."""
        handler = self._commands.get(request.command)
        if handler is None:
            return CommandResult(Refusal.UNKNOWN, f"there is no command {request.command}")
        if request.axis and request.axis not in self._compensation.pulses:
            return self._unknown_axis(request.axis)
        return handler(request.axis)

    def change(self, setting: str, value: float | str | bool) -> CommandResult:
        """Change a field of `Settings`, SI units, or refuse with a reason."""
        if setting not in self._setters:
            return CommandResult(Refusal.UNKNOWN, f"there is no setting {setting}")
        if reason := SETTINGS[setting].objection(value):
            return CommandResult(Refusal.OUT_OF_RANGE, reason)
        self._setters[setting](value)
        self._publisher.changed()
        return _ACCEPTED

    def jog(self, axis: str, velocity_m_s: float) -> CommandResult:
        """Move an axis at this velocity while the caller renews it; 0 stops the axis."""
        if axis not in self._compensation.pulses:
            return self._unknown_axis(axis)
        return self._operating.jog(axis, velocity_m_s)

    def jog_step(self, axis: str, distance_m: float) -> CommandResult:
        """Move an axis by this distance, at most 10 mm, to rest."""
        if axis not in self._compensation.pulses:
            return self._unknown_axis(axis)
        return self._operating.jog_step(axis, distance_m)

    def touch_off(self, axis: str, value_m: float) -> CommandResult:
        """Shift the chosen work offset so that this axis, "" = all, stands at the coordinate `value_m`."""
        if axis and axis not in self._compensation.pulses:
            return self._unknown_axis(axis)
        return self._operating.touch_off(axis, value_m)

    def reading(self, first_line: int = 1) -> ReadingOptions:
        """Return the present options for reading a part program. Raises ConfigError."""
        return ReadingOptions(
            work_offsets_m=self._programs.offsets.for_part_programs(), first_line=first_line
        )

    def reading_of_line(self) -> ReadingOptions:
        """Return the options for a line of G-code that starts where the axes stand. Raises ConfigError."""
        offsets = self._programs.offsets
        return ReadingOptions(
            work_offsets_m={offsets.chosen: {}, **offsets.for_part_programs()},
            modes=replace(self._programs.modes, work_offset=offsets.chosen),
            start_m=self._machine.set_points_m(),
        )

    def run_line(self, program: PartProgram) -> CommandResult:
        """Run a line of G-code from where the axes stand; its modal words hold for the next line."""
        return self._programs.run_line(program)

    def load_program(self, program: ProgramConfig) -> CommandResult:
        """Check a program and make it the program of the run."""
        return self._programs.load(program)

    def learn(self, axes: Sequence[str], learner: str | None, *, fresh: bool) -> CommandResult:
        """Learn these axes one after the other; none = all axes that the learner applies to."""
        verdict = self.objection(axes, learner)
        if verdict.accepted:
            verdict = self._program.occupied() or self._job.start(
                self._learnable(axes, learner), self._learner_or_default(learner), fresh=fresh
            )
        self._publisher.changed()
        return verdict

    def objection(self, axes: Sequence[str], learner: str | None) -> CommandResult:
        """Refuse to learn these axes if no state of the machine permits it."""
        for name in axes:
            if name not in self._compensation.pulses:
                return self._unknown_axis(name)
        section = self._section(learner)
        if problem := self._compensation.objection(axes, section):
            return problem
        for name in self._learnable(axes, learner):
            if reason := self._beyond_limits[section].get(name):
                return CommandResult(Refusal.OUT_OF_RANGE, reason)
        return _ACCEPTED

    def status(self) -> MachineStatus:
        """Return the present status."""
        machine, pulses = self._machine, self._compensation.pulses.values()
        axes = tuple(self._axis_status(index, axis) for index, axis in enumerate(pulses))
        return MachineStatus(
            stage=machine.stage,
            cycles=machine.cycles,
            missed_ticks=machine.missed_ticks,
            learning=self._job.status(),
            axes=axes,
            settings=Settings(
                required_m=self._monitor.required_m,
                learner=self._learner,
                adaptation=self._adaptation.on,
                feed_override_percent=round(100.0 * self._motion.pace.feed, 6),
                rapid_override_percent=round(100.0 * self._motion.pace.rapid, 6),
                single_block=self._motion.single_block,
                optional_stop=self._motion.optional_stop,
                step_m=self._operating.step_m,
                work_offset=self._programs.offsets.chosen,
            ),
            reason=machine.reason,
            drives=self._operating.drives(),
            program=self._programs.status(),
            setting_up=machine.setting_up,
            contour=machine.contour,
        )

    def _axis_status(self, index: int, axis: AxisCompensation) -> AxisStatus:
        monitor, stored = self._monitor, axis.stored
        return AxisStatus(
            name=axis.name,
            compensation_enabled=axis.enabled,
            observer_enabled=axis.observer,
            learning_due=monitor.due[index],
            reversals=monitor.counts[index],
            last=monitor.last[index],
            version=stored.version if stored is not None else 0,
            learned_at=stored.learned_at if stored is not None else "",
            learned=axis.learned,
            screw=_stored_status(ScrewStatus, self._compensation.screws[axis.name]),
            waveform=_stored_status(WaveformStatus, self._compensation.waveforms[axis.name]),
            compensation_suspended=axis.suspended,
            temperature_degc=self._compensation.waveforms[axis.name].temperature.degc,
        )

    def _start_learning(self, axis: str) -> CommandResult:
        return self.learn([axis] if axis else [], None, fresh=False)

    def _roll_back(self, roll_back: Callable[[str], CommandResult], axis: str) -> CommandResult:
        return self._job.occupied() or roll_back(axis)

    def _learner_or_default(self, learner: str | None) -> str:
        return learner or self._learner

    def _set_required(self, value: Any) -> None:
        self._monitor.required_m = value

    def _set_learner(self, value: Any) -> None:
        self._learner = value

    def _section(self, learner: str | None) -> str:
        """Return the section of the machine file that the learner needs."""
        return {SCREW: SCREW_SECTION, WAVEFORM: WAVEFORM_SECTION}.get(
            self._learner_or_default(learner), PULSE
        )

    def _learnable(self, axes: Sequence[str], learner: str | None) -> list[str]:
        return list(dict.fromkeys(axes)) or self._compensation.axes_with[self._section(learner)]

    def _unknown_axis(self, name: str) -> CommandResult:
        known = ", ".join(self._compensation.pulses)
        return CommandResult(Refusal.UNKNOWN, f'there is no axis "{name}", only {known}')


def _stored_status(kind: type[Status], axis: ScrewCompensation | WaveformCompensation) -> Status:
    """Status of a compensation; its fields have the names of those of the stored version and its result."""
    if (stored := axis.stored) is None:
        return kind(enabled=axis.enabled)
    values = {**stored.learned._asdict(), **stored._asdict(), "enabled": axis.enabled}
    return kind(**{name: values[name] for name in kind._fields})
