"""Executes commands for the machine itself: power, homing, jogging and work offsets.

A command that is impossible now is refused with a reason and has no effect. Stops are never refused.
"""

import math
from collections.abc import Callable, Sequence

from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.axis.servo import AxisServo
from servo_ctrl.commands.command import (
    JOG_RENEWAL_S,
    LONGEST_STEP_M,
    STEP_M_S,
    Command,
    CommandResult,
    Refusal,
)
from servo_ctrl.commands.machine_status import DriveStatus
from servo_ctrl.commands.objections import NO_POWER, NOT_AT_REST, NOT_IN_STANDBY
from servo_ctrl.commands.settings import Settings
from servo_ctrl.commands.stage import Stage, refused, refused_now
from servo_ctrl.commands.status_publisher import StatusPublisher
from servo_ctrl.config.model import Limits, MachineConfig
from servo_ctrl.cyclic.drive_phases import PHASE_TEXTS, Phase
from servo_ctrl.daemon.cycle.machine import MachineController
from servo_ctrl.daemon.handlers.program_commands import ProgramCommands
from servo_ctrl.daemon.set_points.jog import Jog, JogLimits
from servo_ctrl.units import MM

NOT_RESPONDING = "not responding"
"""Published state of a drive that no longer responds."""
_ACCEPTED = CommandResult()


class OperatingCommands:
    """`commands` take the name of an axis, "" = all; commands for the whole machine ignore it."""

    def __init__(
        self,
        config: MachineConfig,
        machine: MachineController,
        servos: Sequence[AxisServo],
        programs: ProgramCommands,
        publisher: StatusPublisher,
    ) -> None:
        self._machine, self._servos = machine, tuple(servos)
        self._programs, self._publisher = programs, publisher
        self._period_s = config.period_s
        self._limits = {name: _jog_limits(axis.limits) for name, axis in config.axes.items()}
        self._jog: Jog | None = None
        self.commands: dict[Command, Callable[[str], CommandResult]] = {
            Command.ENABLE: lambda _axis: self._enable(),
            Command.DISABLE: lambda _axis: self._disable(),
            Command.QUICK_STOP: lambda _axis: self._quick_stop(),
            Command.HOME: self._home,
            Command.STEP_FORWARD: lambda axis: self._step(axis, self.step_m),
            Command.STEP_BACKWARD: lambda axis: self._step(axis, -self.step_m),
            Command.TOUCH_OFF: lambda axis: self.touch_off(axis, 0.0),
            Command.CLEAR_OFFSET: self._clear_offset,
        }
        self.step_m: float = Settings._field_defaults["step_m"]
        """Distance of the commands that move by a step, metres."""

    def jog(self, axis: str, velocity_m_s: float) -> CommandResult:
        """Move an axis at this velocity while the caller renews it; 0 stops the axis."""
        if not math.isfinite(velocity_m_s):
            return CommandResult(Refusal.OUT_OF_RANGE, "the velocity is not a number")
        fastest = self._limits[axis].velocity_m_s
        if abs(velocity_m_s) > fastest:
            request = f"{velocity_m_s / MM:g} mm/s is beyond the velocity limit of axis {axis}"
            return CommandResult(Refusal.OUT_OF_RANGE, f"{request}, {fastest / MM:g} mm/s")
        machine = self._machine
        index = list(self._limits).index(axis)
        if self._jog is not None and machine.follows(self._jog):
            self._jog.request_velocity(index, velocity_m_s)
            return _ACCEPTED
        if problem := self._programs.occupied():
            return problem
        if machine.stage is not Stage.READY:
            return refused_now(machine)
        if velocity_m_s:
            self._jog = self._new_jog()
            self._jog.request_velocity(index, velocity_m_s)
            machine.run(self._jog)
            self._publisher.changed()
        return _ACCEPTED

    def set_step(self, distance_m: float) -> None:
        """Set the distance of the commands that move by a step."""
        self.step_m = distance_m

    def jog_step(self, axis: str, distance_m: float) -> CommandResult:
        """Move an axis by this distance, at most 10 mm and within its travel, to rest."""
        if not 0.0 < abs(distance_m) <= LONGEST_STEP_M * (1.0 + 1e-9):
            longest = f"{LONGEST_STEP_M / MM:g} mm"
            return CommandResult(Refusal.OUT_OF_RANGE, f"a step is longer than 0 and at most {longest}")
        machine, index = self._machine, list(self._limits).index(axis)
        jog = self._jog if self._jog is not None and machine.follows(self._jog) else None
        if jog is None:
            if problem := self._programs.occupied():
                return problem
            if machine.stage is not Stage.READY:
                return refused_now(machine)
            jog = self._new_jog()
        if reason := jog.request_step(index, distance_m, STEP_M_S):
            return refused(reason)
        if jog is not self._jog:
            self._jog = jog
            machine.run(jog)
            self._publisher.changed()
        return _ACCEPTED

    def touch_off(self, axis: str, value_m: float) -> CommandResult:
        """Shift the chosen work offset so that this axis, "" = all, stands at the coordinate `value_m`."""
        if problem := self._programs.occupied():
            return problem
        if self._machine.stage is not Stage.READY:
            return refused_now(self._machine)
        position_of_m = dict(zip(self._limits, self._machine.set_points_m(), strict=True))
        axes = [axis] if axis else list(position_of_m)
        if not math.isfinite(value_m):
            return CommandResult(Refusal.OUT_OF_RANGE, "the value is not a number")
        return self._programs.offsets.set(axes, [position_of_m[name] for name in axes], value_m)

    def drives(self) -> tuple[DriveStatus, ...]:
        """Return the status of the drives by their last inputs."""
        statuses = []
        for servo, limits in zip(self._servos, self._limits.values(), strict=True):
            phase, inputs = servo.phase, servo.inputs
            statuses.append(
                DriveStatus(
                    axis=servo.name,
                    phase=PHASE_TEXTS[phase],
                    state=NOT_RESPONDING if phase is Phase.LOST else servo.drive_state.value,
                    statusword=inputs.statusword,
                    error_code=servo.error_code,
                    homed=servo.homed,
                    position_m=inputs.motor_m,
                    ready=servo.ready,
                    limits_m=(limits.lowest_m, limits.highest_m),
                )
            )
        return tuple(statuses)

    def _step(self, axis: str, distance_m: float) -> CommandResult:
        if problem := self._programs.occupied():
            return problem
        if not axis and len(self._limits) > 1:
            return CommandResult(Refusal.UNKNOWN, f"a step needs its axis: {', '.join(self._limits)}")
        return self.jog_step(axis or next(iter(self._limits)), distance_m)

    def _clear_offset(self, axis: str) -> CommandResult:
        if problem := self._programs.occupied():
            return problem
        if self._machine.stage not in {Stage.READY, Stage.STANDBY}:
            return refused_now(self._machine, NOT_AT_REST)
        return self._programs.offsets.clear([axis] if axis else list(self._limits))

    def _new_jog(self) -> Jog:
        renewal = round(JOG_RENEWAL_S / self._period_s)
        return Jog(self._machine.set_points_m(), tuple(self._limits.values()), self._period_s, renewal)

    def _enable(self) -> CommandResult:
        machine = self._machine
        if problem := self._programs.occupied():
            return problem
        if machine.stage is not Stage.STANDBY:
            return refused_now(machine, NOT_IN_STANDBY)
        if reason := machine.enable():
            return refused(reason)
        self._publisher.changed()
        return _ACCEPTED

    def _disable(self) -> CommandResult:
        machine = self._machine
        if not machine.stage.under_way and not machine.setting_up:
            return refused_now(machine, NO_POWER)
        machine.event(Event.DISABLE, "switched off by the operator")
        return _ACCEPTED

    def _quick_stop(self) -> CommandResult:
        if self._machine.stage is Stage.BOOTING:
            return refused_now(self._machine, "and nothing moves")
        self._machine.event(Event.QUICK_STOP, "quick stop by the operator")
        return _ACCEPTED

    def _home(self, axis: str) -> CommandResult:
        machine = self._machine
        servos = [servo for servo in self._servos if servo.homes and axis in {"", servo.name}]
        if not servos:
            whose = f"axis {axis} has" if axis else "the axes have"
            return refused(f"{whose} no homing method (homing_method = 0)")
        if problem := self._programs.occupied():
            return problem
        if machine.stage is not Stage.READY:
            return refused_now(machine)
        machine.home(servos)
        self._publisher.changed()
        return _ACCEPTED


def _jog_limits(limits: Limits) -> JogLimits:
    lowest_m, highest_m = (limit_mm * MM for limit_mm in limits.position_mm)
    return JogLimits(lowest_m, highest_m, limits.velocity_mm_s * MM, limits.acceleration_mm_s2 * MM)
