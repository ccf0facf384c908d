"""Makes and connects the services beside the cycle: compensation, monitoring, learning, command handler.

One object knows all services, so that they need not know each other.
"""

import asyncio
from collections.abc import Coroutine, Sequence

from kernels.arrays import Array
from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.axis.servo import AxisServo
from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.commands.status_publisher import StatusPublisher
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.cycle.background_worker import BackgroundWorker
from servo_ctrl.daemon.cycle.machine import MachineController
from servo_ctrl.daemon.cycle.rows import RowRouter
from servo_ctrl.daemon.handlers.command_handler import ControllerCommandHandler
from servo_ctrl.daemon.handlers.compensation_commands import CompensationCommands
from servo_ctrl.daemon.handlers.operating_commands import OperatingCommands
from servo_ctrl.daemon.handlers.program_commands import ProgramCommands
from servo_ctrl.daemon.handlers.program_start import ProgramStart
from servo_ctrl.daemon.handlers.work_offsets import WorkOffsets
from servo_ctrl.daemon.learning.adaptation import Adaptation
from servo_ctrl.daemon.learning.axis_learning import AxisLearning, LearningError
from servo_ctrl.daemon.learning.learning_job import LearningJob
from servo_ctrl.daemon.learning.production import Production
from servo_ctrl.daemon.learning.pulse_compensation import load_compensation
from servo_ctrl.daemon.learning.pulse_learning import PulseLearning
from servo_ctrl.daemon.learning.screw_compensation import load_screws
from servo_ctrl.daemon.learning.screw_learning import ScrewLearning
from servo_ctrl.daemon.learning.waveform_adaptation import WaveformAdaptation
from servo_ctrl.daemon.learning.waveform_compensation import load_waveforms
from servo_ctrl.daemon.learning.waveform_learning import WaveformLearning
from servo_ctrl.daemon.run.run_options import RunOptions
from servo_ctrl.daemon.run.tuning_runs import TuningRuns
from servo_ctrl.daemon.set_points.motion_plan import MotionPlan
from servo_ctrl.learned.store import LearnedStore, ScrewStore, WaveformStore, default_directory
from servo_ctrl.learning.screw import LEARNER as SCREW
from servo_ctrl.learning.types import ReversalReport
from servo_ctrl.learning.waveform_run import LEARNER as WAVEFORM
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
        self._begun = motion.empty and options.learn is None
        """Whether the run's program or learning was started, or there is none."""
        self._in_standby = options.stand_by and self._begun
        self._over = False
        """Whether the requested learning has ended, with or without success."""
        directory = options.learned_dir or default_directory(config)
        store, screw_store = LearnedStore(directory, config), ScrewStore(directory, config)
        waveform_store = WaveformStore(directory, config)
        axes = load_compensation(config, servos, store, options.compensation)
        screws = load_screws(config, servos, screw_store, options.compensation)
        waveforms = load_waveforms(config, servos, waveform_store, options.compensation)
        by_name, screw_of = {axis.name: axis for axis in axes}, {axis.name: axis for axis in screws}
        self._waveforms = waveforms
        waveform_of = {axis.name: axis for axis in waveforms}
        problems = [axis.problem for axis in axes] + [axis.problem for axis in screws]
        problems += [axis.problem for axis in waveforms]
        self._problems = [problem for problem in problems if problem]
        self.worker = BackgroundWorker(lockstep=lockstep)
        self.publisher = StatusPublisher()
        self.adaptation = Adaptation(config, by_name, store, self.worker, machine.note)
        self.waveform_adaptation = WaveformAdaptation(
            config, waveform_of, waveform_store, self.worker, machine.note, lambda: self.adaptation.on
        )
        self.production = Production(config, self.publisher, note=machine.note, adapt=self._adapt)
        self.rows = RowRouter(self.production.monitor.observe)
        # Without a program the axes stay under control, ready for commands.
        machine.served = options.serve or options.stand_by or motion.empty
        machine.stand_by = options.stand_by
        machine.record = self.rows.take
        machine.on_enable = self.on_enable
        machine.on_ready, machine.on_rest, machine.on_stop = self.on_ready, self.on_rest, self.on_stop

        def learning_of(axis: str, learner: str) -> AxisLearning:
            if learner == SCREW:
                return ScrewLearning(config, screw_store, screw_of[axis], motion)
            if learner == WAVEFORM:
                waveform = waveform_of[axis]
                return WaveformLearning(config, waveform_store, waveform, by_name[axis], motion)
            return PulseLearning(config, learner, store, by_name[axis], motion, waveform_of[axis])

        self.job = LearningJob(
            machine, learning_of, self.worker, self.rows, self.publisher, on_end=self._on_learning_end
        )
        self._program = ProgramStart(machine, motion, self.worker, self.publisher.changed)
        offsets = WorkOffsets(
            config, directory, self.worker, note=machine.note, on_change=motion.offsets_changed
        )
        if offsets.problem:
            self._problems.append(offsets.problem)
        programs = ProgramCommands(
            machine, motion, self.job, self._program, self.worker, self.publisher, offsets
        )
        compensation = CompensationCommands(
            by_name,
            screw_of,
            waveform_of,
            store=store,
            screw_store=screw_store,
            waveform_store=waveform_store,
            worker=self.worker,
            publisher=self.publisher,
            note=machine.note,
        )
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
        self.handler = ControllerCommandHandler(
            config,
            machine,
            motion,
            compensation=compensation,
            publisher=self.publisher,
            job=self.job,
            monitor=self.production.monitor,
            adaptation=self.adaptation,
            program=self._program,
            programs=programs,
            operating=OperatingCommands(config, machine, servos, programs, self.publisher),
        )
        if self._learn is not None:
            verdict = self.handler.objection(self._learn.axes, self._learn.learner)
            if not verdict.accepted:
                raise LearningError(verdict.reason)
        self._link = self._mqtt_link(config)

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
        return self._motion.completed if self._learn is None else self.job.state is LearningState.DONE

    @property
    def problem(self) -> str:
        """Why the requested learning failed although nothing stopped the machine; else ""."""
        if self._learn is None or self.completed or self.machine.reason:
            return ""
        return self.job.status().reason

    def begin(self) -> None:
        """Begin the run after the nodes have booted."""
        self.machine.begin(in_standby=self._in_standby)
        for problem in self._problems:
            self.machine.note(problem)

    def on_ready(self) -> None:
        """Start the run's learning or program once the axes follow set points."""
        begun, self._begun = self._begun, True
        if not begun and self._learn is not None:
            verdict = self.handler.learn(self._learn.axes, self._learn.learner, fresh=self._learn.fresh)
            if not verdict.accepted:
                self.machine.event(Event.BAD_PROGRAM, verdict.reason)
        elif not begun:
            self._program.start_run()
        self.publisher.changed()

    def on_enable(self, ends_a_fault: bool) -> None:
        """Publish that the drives are switched on from standby."""
        if ends_a_fault:
            self.publisher.recovered()
        self.publisher.changed()

    def on_rest(self) -> None:
        """Continue learning or end the run, after a motion has ended or the machine entered standby."""
        self.job.on_rest()
        self.tuning.on_rest()
        self._finish()
        self.publisher.changed()

    def on_stop(self, reason: str) -> None:
        """End learning because the machine stops."""
        self._begun = True
        self.job.on_stop(reason)
        self.tuning.on_stop(reason)
        self.publisher.changed()

    def tasks(self) -> list[Coroutine[None, None, None]]:
        """Return the coroutines that run beside the cycle until cancelled."""
        return [self.worker.run(), *([self._link.run()] if self._link is not None else [])]

    async def finish(self) -> None:
        """Store the adapted functions and let the worker finish its queue."""
        self.adaptation.store()
        self.waveform_adaptation.store()
        try:
            async with asyncio.timeout(FINISH_LIMIT_S):
                await self.worker.finish()
        except TimeoutError:
            text = f"what was still to be stored was not, within {FINISH_LIMIT_S:g} s: the disk hangs"
            self.machine.note(text)

    def _adapt(self, index: int, report: ReversalReport, trace_m: Array) -> None:
        """Let what acts on an axis learn from a reversal: its waveform, else its pulse."""
        if self._waveforms[index].acts:
            self.waveform_adaptation.take(index, report, trace_m)
        else:
            self.adaptation.take(index, report, trace_m)

    def _on_learning_end(self) -> None:
        if self._learn is not None:
            self._over = True
            self._finish()

    def _finish(self) -> None:
        if self._over:
            self.machine.finish()
