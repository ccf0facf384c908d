"""The daemon's answer to whoever asks: over SDO, MQTT and the command line alike; see `config.desk`."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

from servo_ctrl.axis.fault_policy import Stage
from servo_ctrl.config.desk import (
    LEARNERS,
    AxisStatus,
    Command,
    DeskStatus,
    Refusal,
    Request,
    ScrewStatus,
    Setting,
    Verdict,
)
from servo_ctrl.daemon.compensation_desk import PULSE
from servo_ctrl.daemon.compensation_desk import SCREW as SCREW_SECTION
from servo_ctrl.learning.screw import LEARNER as SCREW

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.config.program_model import ProgramConfig
    from servo_ctrl.daemon.adaptation import Adaptation
    from servo_ctrl.daemon.announcer import Announcer
    from servo_ctrl.daemon.assembly import Assembly
    from servo_ctrl.daemon.compensation import AxisCompensation
    from servo_ctrl.daemon.compensation_desk import CompensationDesk
    from servo_ctrl.daemon.learning_job import LearningJob
    from servo_ctrl.daemon.monitoring import Monitoring
    from servo_ctrl.daemon.motion_plan import MotionPlan
    from servo_ctrl.daemon.operating_desk import OperatingDesk
    from servo_ctrl.daemon.program_desk import ProgramDesk
    from servo_ctrl.daemon.program_start import ProgramStart
    from servo_ctrl.daemon.screw_compensation import ScrewCompensation

RANGES = {
    Setting.REQUIRED_M: (1e-9, 1e-2),
    Setting.LEARNER: (0, len(LEARNERS) - 1),
    Setting.ADAPTATION: (0, 1),
}
CHOICES = frozenset({Setting.LEARNER, Setting.ADAPTATION})
"""Settings that are whole numbers."""
_ACCEPTED = Verdict()


class ControllerDesk:
    """There from the start."""

    def __init__(
        self,
        config: MachineConfig,
        motion: MotionPlan,
        compensation: Mapping[str, AxisCompensation],
        screws: Mapping[str, ScrewCompensation],
        switches: CompensationDesk,
        announcer: Announcer,
        job: LearningJob,
        monitoring: Monitoring,
        adaptation: Adaptation,
        program: ProgramStart,
        programs: ProgramDesk,
        operating: OperatingDesk,
    ) -> None:
        self._compensation, self._screws, self._switches = compensation, screws, switches
        self._announcer, self._job, self._monitoring = announcer, job, monitoring
        self._adaptation = adaptation
        self._program, self._programs, self._operating = program, programs, operating
        self._learner = LEARNERS.index(config.learning.learner)
        self._assembly: Assembly | None = None
        self._beyond_limits = {
            PULSE: motion.strokes_beyond_limits(),
            SCREW_SECTION: motion.travels_beyond_limits(),
        }
        """Checked before anything moves."""
        self._commands: dict[Command, Callable[[str], Verdict]] = {
            Command.START_LEARNING: self._start_learning,
            Command.ABORT_LEARNING: lambda _axis: job.abort(),
            Command.PAUSE_LEARNING: lambda _axis: job.pause(),
            Command.RESUME_LEARNING: lambda _axis: self._resume(),
            **programs.commands,
            **operating.commands,
            **switches.commands,
            **{command: partial(self._roll_back, roll) for command, roll in switches.rolls_back.items()},
        }

    def attach(self, assembly: Assembly) -> None:
        """The machine is there."""
        self._assembly = assembly
        self._programs.attach(assembly.machine)
        self._operating.attach(assembly.machine)

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
        if setting in CHOICES and not float(value).is_integer():
            return Verdict(Refusal.OUT_OF_RANGE, f"{value:g} is no whole number")
        match setting:
            case Setting.REQUIRED_M:
                self._monitoring.required_m = value
            case Setting.LEARNER:
                self._learner = int(value)
            case Setting.ADAPTATION:
                self._adaptation.switch(on=value == 1.0)
        self._announcer.changed()
        return _ACCEPTED

    def jog(self, axis: str, velocity_m_s: float) -> Verdict:
        """Move an axis at this velocity until that is not renewed any more; 0 stops it."""
        if axis not in self._compensation:
            return self._unknown(axis)
        return self._operating.jog(axis, velocity_m_s)

    def load_program(self, program: ProgramConfig) -> Verdict:
        """Check a program and put it in the place of the run's."""
        return self._programs.load(program)

    def learn(self, axes: Sequence[str], learner: str | None, *, fresh: bool) -> Verdict:
        """Learn these axes, one after the other; none = all that have what the learner learns."""
        verdict = self.objection(axes, learner)
        if verdict.accepted:
            verdict = self._program_first() or self._job.start(
                self._learnable(axes, learner), self._chosen(learner), fresh=fresh
            )
        self._announcer.changed()
        return verdict

    def objection(self, axes: Sequence[str], learner: str | None) -> Verdict:
        """What speaks against learning these axes, whatever the machine is doing."""
        for name in axes:
            if name not in self._compensation:
                return self._unknown(name)
        section = self._section(learner)
        if problem := self._switches.lacking(axes, section):
            return problem
        for name in self._learnable(axes, learner):
            if reason := self._beyond_limits[section].get(name):
                return Verdict(Refusal.OUT_OF_RANGE, reason)
        return _ACCEPTED

    def status(self) -> DeskStatus:
        """What there is to know now."""
        stage, cycles, missed, reason = Stage.BOOTING, 0, 0, ""
        if self._assembly is not None:
            machine, cycle = self._assembly
            stage, cycles, missed = machine.stage, cycle.number + 1, machine.missed_ticks
            reason = machine.reason
        axes = tuple(self._axis_status(index, axis) for index, axis in enumerate(self._compensation.values()))
        settings = {
            Setting.REQUIRED_M: self._monitoring.required_m,
            Setting.LEARNER: float(self._learner),
            Setting.ADAPTATION: float(self._adaptation.on),
        }
        return DeskStatus(
            stage,
            cycles,
            missed,
            self._job.status(),
            axes,
            settings,
            reason,
            self._operating.drives(),
            self._programs.status(),
        )

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
            screw=_screw_status(self._screws[axis.name]),
        )

    def _program_first(self) -> Verdict | None:
        if not self._program.preparing:
            return None
        return Verdict(Refusal.WRONG_STATE, "the program is about to start; wait for its end")

    def _resume(self) -> Verdict:
        return self._program_first() or self._job.resume()

    def _start_learning(self, axis: str) -> Verdict:
        return self.learn([axis] if axis else [], None, fresh=False)

    def _roll_back(self, roll_back: Callable[[str], Verdict], axis: str) -> Verdict:
        return self._learning_first() or roll_back(axis)

    def _learning_first(self) -> Verdict | None:
        if not self._job.has_the_axes:
            return None
        return Verdict(Refusal.WRONG_STATE, "an axis is learning; pause or abort it first")

    def _chosen(self, learner: str | None) -> str:
        return learner or LEARNERS[self._learner]

    def _section(self, learner: str | None) -> str:
        """Of the machine file, without which there is nothing to be learned."""
        return SCREW_SECTION if self._chosen(learner) == SCREW else PULSE

    def _learnable(self, axes: Sequence[str], learner: str | None) -> list[str]:
        return list(dict.fromkeys(axes)) or self._switches.fitted(self._section(learner))

    def _unknown(self, name: str) -> Verdict:
        known = ", ".join(self._compensation)
        return Verdict(Refusal.UNKNOWN, f'there is no axis "{name}", only {known}')


def _screw_status(screw: ScrewCompensation) -> ScrewStatus:
    stored = screw.stored
    if stored is None:
        return ScrewStatus(enabled=screw.enabled)
    return ScrewStatus(screw.enabled, stored.version, stored.learned_at, stored.learned)
