"""Makes the motions of a tuning on command: with other gains on one axis, bounded, each with its recording.

`servo-ctrl tune --controller` requests them, measures in its own process, and writes the proposal. After each
motion, whatever ended it, the values of the machine file act again.
"""

import asyncio
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import ValidationError

from servo_ctrl.axis.servo import AxisServo
from servo_ctrl.commands.client_activity import ClientActivity
from servo_ctrl.commands.command import CommandResult, Refusal
from servo_ctrl.commands.local_messages import TuningRun
from servo_ctrl.commands.objections import OVERRIDDEN
from servo_ctrl.commands.stage import Stage, refused, refused_now
from servo_ctrl.config.kernel_params import axis_params, with_observer, with_sampled_dual_loop
from servo_ctrl.config.law_sections import SECTION_TYPES, period_objections
from servo_ctrl.config.model import Control, MachineConfig
from servo_ctrl.config.program_model import ProgramConfig
from servo_ctrl.control.compensation import notch
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.daemon.cycle.background_worker import BackgroundWorker
from servo_ctrl.daemon.cycle.machine import MachineController
from servo_ctrl.daemon.cycle.rows import RowRouter
from servo_ctrl.daemon.handlers.program_commands import ProgramCommands
from servo_ctrl.daemon.handlers.program_start import ProgramStart
from servo_ctrl.daemon.run.client_watch import CONNECTION_LOST, ClientWatch
from servo_ctrl.daemon.run.report import recording_header, with_spans
from servo_ctrl.daemon.run.run_recording import LOCKSTEP_WAIT_S
from servo_ctrl.daemon.set_points.feed_hold import FeedHold
from servo_ctrl.daemon.set_points.motion_plan import MotionPlan
from servo_ctrl.errors import ConfigError, ServoCtrlError
from servo_ctrl.excitation.measuring_motion import LARGEST_FORCE_SHARE
from servo_ctrl.excitation.tuning_motion import TuningMotion, motion_steps
from servo_ctrl.recording.channels import channels_of
from servo_ctrl.recording.recorder import Recorder

ABORTED = "it was aborted"


class _Prepared(NamedTuple):
    """A motion that is planned, and its recording."""

    program: FeedHold
    recorder: Recorder
    header: dict[str, Any]


class _Running(NamedTuple):
    """The motion that is being made."""

    prepared: _Prepared
    servo: AxisServo
    watch: ClientWatch
    ended: asyncio.Future[str]
    """Why it ended early, "" at its end."""


class TuningRunError(ServoCtrlError):
    """A motion of a tuning could not be made, or ended early."""


class TuningRuns:
    """Makes one motion at a time."""

    def __init__(
        self,
        config: MachineConfig,
        machine: MachineController,
        servos: Sequence[AxisServo],
        motion: MotionPlan,
        *,
        program: ProgramStart,
        programs: ProgramCommands,
        worker: BackgroundWorker,
        rows: RowRouter,
        lockstep: bool,
    ) -> None:
        self._config, self._machine, self._motion = config, machine, motion
        self._servos = {servo.name: servo for servo in servos}
        self._program, self._programs = program, programs
        self._worker, self._rows, self._lockstep = worker, rows, lockstep
        self._running: _Running | None = None

    async def run(self, request: TuningRun, directory: Path, activity: ClientActivity) -> CommandResult:
        """Make a motion and record it into `directory`, which must be new; return at its end.

        The axes come to rest once the client is disconnected or silent: nobody may watch them.
        Raises TuningRunError, ConfigError.
        """
        if problem := self.objection(request):
            return problem
        params = _without_compensations(axis_params(self._with_values(request), request.axis))
        loop = asyncio.get_running_loop()
        prepared: asyncio.Future[_Prepared] = loop.create_future()
        start_m = self._machine.set_points_m()
        self._program.preparing = True
        self._worker.do(
            lambda: self._prepare(request, start_m, directory),
            prepared.set_result,
            lambda reason: prepared.set_exception(TuningRunError(reason)),
        )
        try:
            ready = await prepared
        finally:
            self._program.preparing = False
        reason = CONNECTION_LOST if activity.disconnected else "another motion was started meanwhile"
        if not activity.disconnected and self._machine.stage is Stage.READY and self._running is None:
            servo = self._servos[request.axis]
            watch = ClientWatch(activity, self._config.period_s, lockstep=self._lockstep)
            running = _Running(ready, servo, watch, loop.create_future())
            self._running, self._rows.stroke = running, self._take_row
            servo.try_params(params)
            self._machine.run(ready.program)
            reason = await running.ended
        header = with_spans(ready.header, ready.program.spans)
        header |= {"finished": True, "completed": not reason, "reason": reason}
        await asyncio.to_thread(ready.recorder.close, header)
        if reason:
            raise TuningRunError(f"the tuning run of axis {request.axis} has ended early: {reason}")
        return CommandResult()

    def objection(self, request: TuningRun) -> CommandResult | None:
        """Refuse a motion that cannot be made now, or that is out of bounds."""
        config, pace = self._config.axes.get(request.axis), self._motion.pace
        if config is None:
            known = ", ".join(self._config.axes)
            return CommandResult(Refusal.UNKNOWN, f'there is no axis "{request.axis}", only {known}')
        if problem := self._programs.occupied():
            return problem
        if self._machine.stage is not Stage.READY:
            return refused_now(self._machine)
        reason = self._machine.at_a_switch
        if config.mode != "cst":
            reason = f"axis {request.axis} is in mode {config.mode}; it is tuned in mode cst"
        elif pace.feed != 1.0 or pace.rapid != 1.0:
            reason = OVERRIDDEN
        return refused(reason) if reason else _beyond_bounds(request, config.limits.force_n)

    def on_rest(self) -> None:
        """End the motion of a tuning, if there is one, because it has come to rest."""
        if self._running is not None:
            ended = self._running.prepared.program.ended
            self._end("" if ended else self._running.watch.problem or ABORTED)

    def on_stop(self, reason: str) -> None:
        """End the motion because the machine stops."""
        if self._running is not None:
            self._end(reason)

    def _take_row(self, values: list[float]) -> None:
        """Record the row of a cycle; interrupt the motion when its client is disconnected or silent."""
        running = self._running
        if running is not None:
            running.prepared.recorder.record(values)
            if running.watch.step():
                self._machine.interrupt()

    def _end(self, reason: str) -> None:
        """Let the controller's own values act again, with the compensations that are switched on now."""
        running, self._running = self._running, None
        if running is None:
            return
        self._rows.stroke = None
        running.servo.end_trial()
        running.ended.set_result(reason)

    def _with_values(self, request: TuningRun) -> MachineConfig:
        """Return the machine with the requested values, checked as those of its file. Raises ConfigError."""
        axis = self._config.axes[request.axis]
        name = notch.SECTION.name
        try:
            update: dict[str, Any] = {"control": Control.model_validate(request.control)}
            update[name] = None if request.notch is None else SECTION_TYPES[name](**request.notch)
            checked = type(axis).model_validate(axis.model_copy(update=update).model_dump(exclude_none=True))
        except (ValidationError, TypeError) as error:
            raise ConfigError(self._config.source, f"axis.{request.axis}", str(error)) from None
        for objection in period_objections(checked, self._config.period_s):
            raise ConfigError(self._config.source, f"axis.{request.axis}", objection)
        return self._config.model_copy(update={"axes": {**self._config.axes, request.axis: checked}})

    def _prepare(self, request: TuningRun, start_m: Sequence[float], directory: Path) -> _Prepared:
        """Plan the motion from where the axes stand, and open its recording. Raises ServoCtrlError."""
        motion = TuningMotion(request.axis, request.force_n, request.periods, request.trial)
        steps = motion_steps(motion, self._config, directory.with_name(f"{directory.name}-excitation"))
        source = directory / "tuning"
        program = ProgramConfig.model_validate({"source": source, "step": steps})
        reference = self._motion.prepare_line(program, start_m)
        channels = channels_of(self._config.axes)
        header = recording_header(
            self._config,
            channels,
            (),
            program=source,
            pacing="lockstep" if self._lockstep else "realtime",
            started=datetime.now(UTC),
        )
        wait_s = LOCKSTEP_WAIT_S if self._lockstep else 0.0
        return _Prepared(reference, Recorder(directory, channels, header, wait_s=wait_s), header)


def _without_compensations(params: AxisParams) -> AxisParams:
    """Switch off the compensations of the machine file; learned ones do not act without their tables."""
    return with_sampled_dual_loop(with_observer(params, enabled=False), enabled=False)


def _beyond_bounds(request: TuningRun, limit_n: float) -> CommandResult | None:
    """Refuse a request that adds too much force, or that has no motion."""
    largest_n = LARGEST_FORCE_SHARE * limit_n
    reason = "" if request.periods or request.trial else "the tuning run has no motion"
    if request.force_n > largest_n * (1.0 + 1e-9):
        reason = f"axis {request.axis}: a tuning adds at most {largest_n:g} N, not {request.force_n:g} N"
    return CommandResult(Refusal.OUT_OF_RANGE, reason) if reason else None
