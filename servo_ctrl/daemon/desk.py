"""The daemon's answer to whoever asks: over SDO, MQTT and the command line alike; see `config.desk`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from servo_ctrl.axis.fault_policy import Stage
from servo_ctrl.config.desk import (
    LEARNERS,
    AxisStatus,
    Command,
    DeskStatus,
    Refusal,
    Request,
    Setting,
    Verdict,
)
from servo_ctrl.daemon.compensation import tabulated

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.daemon.adaptation import Adaptation
    from servo_ctrl.daemon.announcer import Announcer
    from servo_ctrl.daemon.assembly import Assembly
    from servo_ctrl.daemon.compensation import AxisCompensation, Functions
    from servo_ctrl.daemon.learning_job import LearningJob
    from servo_ctrl.daemon.monitoring import Monitoring
    from servo_ctrl.daemon.motion_plan import MotionPlan
    from servo_ctrl.daemon.program_start import ProgramStart
    from servo_ctrl.daemon.workshop import Workshop
    from servo_ctrl.telemetry.learned_store import LearnedStore

RANGES = {Setting.REQUIRED_M: (1e-9, 1e-2), Setting.LEARNER: (0.0, 1.0), Setting.ADAPTATION: (0.0, 1.0)}
SWITCHES = frozenset({Setting.LEARNER, Setting.ADAPTATION})
"""Settings that are 0 or 1."""
NO_PULSE_AT_ALL = "no axis has a friction_compensation section"
_ACCEPTED = Verdict()


class ControllerDesk:
    """There from the start."""

    def __init__(
        self,
        config: MachineConfig,
        motion: MotionPlan,
        compensation: Mapping[str, AxisCompensation],
        store: LearnedStore,
        workshop: Workshop,
        announcer: Announcer,
        job: LearningJob,
        monitoring: Monitoring,
        adaptation: Adaptation,
        program: ProgramStart,
    ) -> None:
        self._compensation, self._store, self._workshop = compensation, store, workshop
        self._announcer, self._job, self._monitoring, self._adaptation = (
            announcer,
            job,
            monitoring,
            adaptation,
        )
        self._program = program
        self._learner = LEARNERS.index(config.learning.learner)
        self._assembly: Assembly | None = None
        self._beyond_limits = motion.strokes_beyond_limits()
        """Checked before anything moves."""
        self._commands: dict[Command, Callable[[str], Verdict]] = {
            Command.START_LEARNING: self._start_learning,
            Command.ABORT_LEARNING: lambda _axis: job.abort(),
            Command.PAUSE_LEARNING: lambda _axis: job.pause(),
            Command.RESUME_LEARNING: lambda _axis: self._resume(),
            Command.ENABLE_COMPENSATION: lambda axis: self._switch_pulse(axis, True),
            Command.DISABLE_COMPENSATION: lambda axis: self._switch_pulse(axis, False),
            Command.ENABLE_OBSERVER: lambda axis: self._switch_observer(axis, True),
            Command.DISABLE_OBSERVER: lambda axis: self._switch_observer(axis, False),
            Command.ROLL_BACK: self._roll_back,
            Command.START_PROGRAM: lambda _axis: self._run_program(),
        }

    def attach(self, assembly: Assembly) -> None:
        """The machine is there."""
        self._assembly = assembly

    def execute(self, request: Request) -> Verdict:
        """Carry out a command, or say why not."""
        carry_out = self._commands.get(request.command)
        if carry_out is None:
            return Verdict(Refusal.UNKNOWN, f"there is no command {request.command}")
        if request.axis and request.axis not in self._compensation:
            return self._unknown(request.axis)
        return carry_out(request.axis)

    def change(self, setting: Setting, value: float) -> Verdict:
        """Change a setting, or say why not."""
        if setting not in RANGES:
            return Verdict(Refusal.UNKNOWN, f"there is no setting {setting}")
        lowest, highest = RANGES[setting]
        if not (math.isfinite(value) and lowest <= value <= highest):
            return Verdict(Refusal.OUT_OF_RANGE, f"{value:g} is not within {lowest:g} to {highest:g}")
        if setting in SWITCHES and value not in {0.0, 1.0}:
            return Verdict(Refusal.OUT_OF_RANGE, f"{value:g} is neither 0 nor 1")
        match setting:
            case Setting.REQUIRED_M:
                self._monitoring.required_m = value
            case Setting.LEARNER:
                self._learner = int(value)
            case Setting.ADAPTATION:
                self._adaptation.switch(on=value == 1.0)
        self._announcer.changed()
        return _ACCEPTED

    def learn(self, axes: Sequence[str], learner: str | None, *, fresh: bool) -> Verdict:
        """Learn these axes, one after the other; none = all that have a pulse."""
        verdict = self.objection(axes)
        if verdict.accepted:
            verdict = self._program_first() or self._job.start(
                self._with_pulse(axes), learner or LEARNERS[self._learner], fresh=fresh
            )
        self._announcer.changed()
        return verdict

    def objection(self, axes: Sequence[str]) -> Verdict:
        """What speaks against learning these axes, whatever the machine is doing."""
        if not self._with_pulse(axes):
            return Verdict(Refusal.WRONG_STATE, NO_PULSE_AT_ALL)
        for name in self._with_pulse(axes):
            if name not in self._compensation:
                return self._unknown(name)
            if problem := self._without_pulse(name):
                return problem
            if name in self._beyond_limits:
                return Verdict(Refusal.OUT_OF_RANGE, self._beyond_limits[name])
        return _ACCEPTED

    def status(self) -> DeskStatus:
        """What there is to know now."""
        stage, cycles, missed = Stage.BOOTING, 0, 0
        if self._assembly is not None:
            machine, cycle = self._assembly
            stage, cycles, missed = machine.stage, cycle.number + 1, machine.missed_ticks
        axes = tuple(self._axis_status(index, axis) for index, axis in enumerate(self._compensation.values()))
        settings = {
            Setting.REQUIRED_M: self._monitoring.required_m,
            Setting.LEARNER: float(self._learner),
            Setting.ADAPTATION: float(self._adaptation.on),
        }
        return DeskStatus(stage, cycles, missed, self._job.status(), axes, settings)

    def _axis_status(self, index: int, axis: AxisCompensation) -> AxisStatus:
        watched, stored = self._monitoring, axis.stored
        return AxisStatus(
            name=axis.name,
            compensation_enabled=axis.enabled,
            observer_enabled=axis.observer,
            learning_due=watched.due[index],
            reversals=watched.counts[index],
            last=watched.last[index],
            version=stored.version if stored is not None else 0,
            learned_at=stored.learned_at if stored is not None else "",
            learned=axis.learned,
        )

    def _program_first(self) -> Verdict | None:
        if not self._program.preparing:
            return None
        return Verdict(Refusal.WRONG_STATE, "the program is about to start; wait for its end")

    def _resume(self) -> Verdict:
        return self._program_first() or self._job.resume()

    def _start_learning(self, axis: str) -> Verdict:
        return self.learn([axis] if axis else [], None, fresh=False)

    def _switch_pulse(self, name: str, on: bool) -> Verdict:
        if name and (problem := self._without_pulse(name)):
            return problem
        axes = [axis for axis in self._chosen(name) if axis.has_pulse]
        if not axes:
            return Verdict(Refusal.WRONG_STATE, NO_PULSE_AT_ALL)
        for axis in axes:
            axis.switch(pulse=on)
        self._announcer.changed()
        return _ACCEPTED

    def _switch_observer(self, name: str, on: bool) -> Verdict:
        if name and not self._compensation[name].has_observer:
            return Verdict(Refusal.WRONG_STATE, f"axis {name} has no disturbance_observer section")
        axes = [axis for axis in self._chosen(name) if axis.has_observer]
        if not axes:
            return Verdict(Refusal.WRONG_STATE, "no axis has a disturbance_observer section")
        for axis in axes:
            axis.switch(observer=on)
        self._announcer.changed()
        return _ACCEPTED

    def _roll_back(self, name: str) -> Verdict:
        """In lockstep the verdict knows how it went; in real time what fails is an event."""
        if self._job.has_the_axes:
            return Verdict(Refusal.WRONG_STATE, "an axis is learning; pause or abort it first")
        problems: list[str] = []
        rolled = [axis for axis in self._chosen(name) if axis.stored is not None or axis.problem]
        if not rolled:
            return Verdict(Refusal.WRONG_STATE, "no learned functions are in use")
        for axis in rolled:
            self._roll_back_axis(axis, problems.append)
        return Verdict(Refusal.STORAGE, "; ".join(problems)) if problems else _ACCEPTED

    def _roll_back_axis(self, axis: AxisCompensation, failed: Callable[[str], None]) -> None:
        def then(functions: Functions | None) -> None:
            axis.use(functions)
            version = functions.stored.version if functions is not None else 0
            in_use = f"version {version} is in use" if version else "no learned functions are in use"
            self._note(f"axis {axis.name}: rolled back: {in_use}")
            self._announcer.changed()

        def otherwise(reason: str) -> None:
            self._note(reason)
            failed(reason)

        self._workshop.do(lambda: tabulated(self._store.roll_back(axis.name)), then, otherwise)

    def _run_program(self) -> Verdict:
        if self._job.has_the_axes:
            return Verdict(Refusal.WRONG_STATE, "an axis is learning; pause or abort it first")
        return self._program.again(self._assembly.machine if self._assembly is not None else None)

    def _with_pulse(self, axes: Sequence[str]) -> list[str]:
        return list(dict.fromkeys(axes)) or [
            name for name, axis in self._compensation.items() if axis.has_pulse
        ]

    def _chosen(self, name: str) -> list[AxisCompensation]:
        return [self._compensation[name]] if name else list(self._compensation.values())

    def _unknown(self, name: str) -> Verdict:
        known = ", ".join(self._compensation)
        return Verdict(Refusal.UNKNOWN, f'there is no axis "{name}", only {known}')

    def _without_pulse(self, name: str) -> Verdict | None:
        if self._compensation[name].has_pulse:
            return None
        return Verdict(Refusal.WRONG_STATE, f"axis {name} has no friction_compensation section")

    def _note(self, text: str) -> None:
        if self._assembly is not None:
            self._assembly.machine.note(text)
