"""Makes and connects the services beside the cycle: compensation, monitoring, learning, command handler.

One object holds all services, so that they do not refer to each other.
"""

import asyncio
from collections.abc import Coroutine, Sequence
from pathlib import Path

from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.axis.servo import AxisServo
from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.commands.status_publisher import StatusPublisher
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.cycle.background_worker import BackgroundWorker
from servo_ctrl.daemon.cycle.machine import MachineController
from servo_ctrl.daemon.handlers.command_handler import ControllerCommandHandler
from servo_ctrl.daemon.handlers.compensation_commands import CompensationCommands
from servo_ctrl.daemon.handlers.operating_commands import OperatingCommands
from servo_ctrl.daemon.handlers.program_commands import ProgramCommands
from servo_ctrl.daemon.handlers.program_start import ProgramStart
from servo_ctrl.daemon.handlers.work_offsets import WorkOffsets
from servo_ctrl.daemon.learning.axis_learning import LearningError
from servo_ctrl.daemon.learning.learned_results import LearnedResults
from servo_ctrl.daemon.learning.learning_services import LearningServices
from servo_ctrl.daemon.run.run_options import RunOptions
from servo_ctrl.daemon.run.tuning_runs import TuningRuns
from servo_ctrl.daemon.set_points.motion_plan import MotionPlan
from servo_ctrl.learned.store import default_directory
from servo_ctrl.telemetry.mqtt.service import MqttLink
from servo_ctrl.telemetry.mqtt.stream import RowStream

FINISH_LIMIT_S = 30.0
"""Bounds the wait at the end of a run for files still being written; chosen."""


class Services:
    """Made before the bus is opened; `begin` is called after the boot. Raises ServoCtrlError."""

    def __init__(
        self,
        config: MachineConfig,
        motion: MotionPlan,
        machine: MachineController,
        servos: Sequence[AxisServo],
        options: RunOptions,
        *,
        lockstep: bool,
    ) -> None:
        self.machine, self._motion, self._learn = machine, motion, options.learn
        self._started = motion.empty and options.learn is None
        """Whether the run's program or learning was started, or there is none."""
        self._in_standby = options.stand_by and self._started
        self._learning_over = False
        """Whether the requested learning has ended, with or without success."""
        self.worker = BackgroundWorker(lockstep=lockstep)
        self.publisher = StatusPublisher()
        directory = options.learned_dir or default_directory(config)
        results = LearnedResults(config, servos, directory, options.compensation)
        self._problems = results.problems
        self.learning = LearningServices(
            config,
            machine,
            motion,
            results,
            worker=self.worker,
            publisher=self.publisher,
            on_end=self._on_learning_end,
        )
        self.rows = self.learning.rows
        self._connect_machine(options)
        self._program = ProgramStart(machine, motion, self.worker, self.publisher.changed)
        programs = self._program_commands(config, directory)
        self.tuning = TuningRuns(
            config,
            machine,
            servos,
            motion,
            program=self._program,
            programs=programs,
            worker=self.worker,
            rows=self.rows,
            lockstep=lockstep,
        )
        self.handler = self._command_handler(config, servos, results, programs)
        if self._learn is not None:
            verdict = self.handler.objection(self._learn.axes, self._learn.learner)
            if not verdict.accepted:
                raise LearningError(verdict.reason)
        self._link = self._mqtt_link(config)

    def _program_commands(self, config: MachineConfig, directory: Path) -> ProgramCommands:
        """Make the commands of programs; their work offsets are in the `directory` of learned results."""
        motion, note = self._motion, self.machine.note
        offsets = WorkOffsets(config, directory, self.worker, note=note, on_change=motion.offsets_changed)
        if offsets.problem:
            self._problems.append(offsets.problem)
        return ProgramCommands(
            self.machine,
            motion,
            job=self.learning.job,
            program=self._program,
            worker=self.worker,
            publisher=self.publisher,
            offsets=offsets,
        )

    def _command_handler(
        self,
        config: MachineConfig,
        servos: Sequence[AxisServo],
        results: LearnedResults,
        programs: ProgramCommands,
    ) -> ControllerCommandHandler:
        machine, publisher = self.machine, self.publisher
        return ControllerCommandHandler(
            config,
            machine,
            self._motion,
            compensation=CompensationCommands(results, self.worker, publisher, machine.note),
            publisher=publisher,
            job=self.learning.job,
            monitor=self.learning.production.monitor,
            adaptation=self.learning.adaptation,
            program=self._program,
            programs=programs,
            operating=OperatingCommands(config, machine, servos, programs, publisher),
        )

    def _connect_machine(self, options: RunOptions) -> None:
        """Set the options and callbacks of the machine; without a program the axes stay under control."""
        machine = self.machine
        machine.served = options.serve or options.stand_by or self._motion.empty
        machine.stand_by = options.stand_by
        machine.record = self.rows.take
        machine.on_enable = self.on_enable
        machine.on_ready, machine.on_rest, machine.on_stop = self.on_ready, self.on_rest, self.on_stop

    def _mqtt_link(self, config: MachineConfig) -> MqttLink | None:
        if config.mqtt is None:
            return None
        stream = None
        if config.mqtt.stream:
            stream = RowStream(list(config.axes), config.period_s, config.mqtt.stream_hz)
            self.rows.stream = stream.take
        link = MqttLink(config.mqtt, config.machine.name, self.handler, stream=stream, note=self.machine.note)
        self.publisher.on_change.append(link.changed)
        self.publisher.on_reversal.append(lambda axis, report, _trace_m: link.reversal(axis, report))
        self.publisher.on_due.append(link.due)
        return link

    @property
    def completed(self) -> bool:
        """Whether the requested learning, or else the program, was completed."""
        if self._learn is None:
            return self._motion.completed
        return self.learning.job.state is LearningState.DONE

    @property
    def problem(self) -> str:
        """Why the requested learning failed although nothing stopped the machine; else ""."""
        if self._learn is None or self.completed or self.machine.reason:
            return ""
        return self.learning.job.status().reason

    def begin(self) -> None:
        """Begin the run after the nodes have booted."""
        self.machine.begin(in_standby=self._in_standby)
        for problem in self._problems:
            self.machine.note(problem)

    def on_ready(self) -> None:
        """Start the run's learning or program once the axes follow set points."""
        started, self._started = self._started, True
        if not started and self._learn is not None:
            verdict = self.handler.learn(self._learn.axes, self._learn.learner, fresh=self._learn.fresh)
            if not verdict.accepted:
                self.machine.event(Event.BAD_PROGRAM, verdict.reason)
        elif not started:
            self._program.start_run()
        self.publisher.changed()

    def on_enable(self, ends_a_fault: bool) -> None:
        """Publish that the drives are switched on from standby."""
        if ends_a_fault:
            self.publisher.recovered()
        self.publisher.changed()

    def on_rest(self) -> None:
        """Continue learning or end the run, after a motion has ended or the machine entered standby."""
        self.learning.job.on_rest()
        self.tuning.on_rest()
        self._finish()
        self.publisher.changed()

    def on_stop(self, reason: str) -> None:
        """End learning because the machine stops."""
        self._started = True
        self.learning.job.on_stop(reason)
        self.tuning.on_stop(reason)
        self.publisher.changed()

    def tasks(self) -> list[Coroutine[None, None, None]]:
        """Return the coroutines that run beside the cycle until cancelled."""
        return [self.worker.run(), *([self._link.run()] if self._link is not None else [])]

    async def finish(self) -> None:
        """Store the adapted functions and let the worker finish its queue."""
        self.learning.store()
        try:
            async with asyncio.timeout(FINISH_LIMIT_S):
                await self.worker.finish()
        except TimeoutError:
            text = f"learned results were not stored within {FINISH_LIMIT_S:g} s: the disk does not respond"
            self.machine.note(text)

    def _on_learning_end(self) -> None:
        if self._learn is not None:
            self._learning_over = True
            self._finish()

    def _finish(self) -> None:
        if self._learning_over:
            self.machine.finish()
