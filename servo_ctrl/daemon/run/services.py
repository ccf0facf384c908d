"""What a machine has beside its cycle: compensation, monitoring, learning, and the desk for requests.

One object that knows them all, so that each of them need not know the others.
"""

import asyncio
from collections.abc import Coroutine, Sequence
from pathlib import Path
from typing import NamedTuple

from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.axis.servo import AxisServo
from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.commands.status_publisher import StatusPublisher
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.cycle.assembly import Assembly
from servo_ctrl.daemon.cycle.background_worker import BackgroundWorker
from servo_ctrl.daemon.cycle.machine import Machine
from servo_ctrl.daemon.cycle.rows import RowRouter
from servo_ctrl.daemon.handlers.command_handler import ControllerCommandHandler
from servo_ctrl.daemon.handlers.compensation_commands import CompensationCommands
from servo_ctrl.daemon.handlers.operating_commands import OperatingCommands
from servo_ctrl.daemon.handlers.program_commands import ProgramCommands
from servo_ctrl.daemon.handlers.program_start import ProgramStart
from servo_ctrl.daemon.learning.adaptation import Adaptation
from servo_ctrl.daemon.learning.axis_learning import AxisLearning, LearningError
from servo_ctrl.daemon.learning.learning_job import LearningJob
from servo_ctrl.daemon.learning.production import Production
from servo_ctrl.daemon.learning.pulse_compensation import Compensation, load_compensation
from servo_ctrl.daemon.learning.pulse_learning import PulseLearning
from servo_ctrl.daemon.learning.screw_compensation import load_screws
from servo_ctrl.daemon.learning.screw_learning import ScrewLearning
from servo_ctrl.daemon.set_points.motion_plan import MotionPlan
from servo_ctrl.learned.store import LearnedStore, ScrewStore, default_directory
from servo_ctrl.learning.screw import LEARNER as SCREW
from servo_ctrl.telemetry.mqtt.service import MqttLink
from servo_ctrl.telemetry.mqtt.stream import RowStream

FINISH_LIMIT_S = 30.0


class LearningRequest(NamedTuple):
    """A run that learns and ends; no axes = all that can, no learner = the machine file's."""

    axes: tuple[str, ...] = ()
    learner: str | None = None
    fresh: bool = False
    """Forget what an earlier run had begun."""


class RunOptions(NamedTuple):
    """How a run is made; see `supervisor.run_machine`."""

    serve: bool
    learned_dir: Path | None
    compensation: Compensation
    learn: LearningRequest | None
    stand_by: bool = False
    """A stop ends in standby, not in the end of the run."""


class Services:
    """Made before the bus is opened. Raises ServoCtrlError for what cannot be had."""

    def __init__(
        self,
        config: MachineConfig,
        motion: MotionPlan,
        servos: Sequence[AxisServo],
        options: RunOptions,
        *,
        lockstep: bool,
    ) -> None:
        self._motion, self._learn = motion, options.learn
        self._served = options.serve or options.stand_by or motion.empty
        """Without a program the axes are held, and may be asked to do something."""
        self._stand_by = options.stand_by
        self._begun = motion.empty and options.learn is None
        """What the run is for has been begun, or there is nothing."""
        self._over = False
        """What was to be learned has been, or cannot be."""
        self._assembly: Assembly | None = None
        directory = options.learned_dir or default_directory(config)
        store, screw_store = LearnedStore(directory, config), ScrewStore(directory, config)
        axes = load_compensation(config, servos, store, options.compensation)
        screws = load_screws(config, servos, screw_store, options.compensation)
        by_name, screw_of = {axis.name: axis for axis in axes}, {axis.name: axis for axis in screws}
        problems = [axis.problem for axis in axes] + [screw.problem for screw in screws]
        self._problems = [problem for problem in problems if problem]
        self.worker = BackgroundWorker(lockstep=lockstep)
        self.publisher = StatusPublisher()
        self.adaptation = Adaptation(config, by_name, store, self.worker, self.note)
        self.production = Production(config, self.publisher, note=self.note, adapt=self.adaptation.take)
        self.rows = RowRouter(self.production.monitoring.observe)

        def learning_of(axis: str, learner: str) -> AxisLearning:
            if learner == SCREW:
                return ScrewLearning(config, screw_store, screw_of[axis], motion)
            return PulseLearning(config, learner, store, by_name[axis], motion)

        self.job = LearningJob(
            learning_of, self.worker, self.rows, self.publisher, on_end=self._on_learning_end
        )
        self._program = ProgramStart(motion, self.worker, self.publisher.changed)
        programs = ProgramCommands(motion, self.job, self._program, self.worker, self.publisher)
        switches = CompensationCommands(
            by_name,
            screw_of,
            store=store,
            screw_store=screw_store,
            worker=self.worker,
            publisher=self.publisher,
            note=self.note,
        )
        self.desk = ControllerCommandHandler(
            config,
            motion,
            compensation=by_name,
            screws=screw_of,
            switches=switches,
            publisher=self.publisher,
            job=self.job,
            monitoring=self.production.monitoring,
            adaptation=self.adaptation,
            program=self._program,
            programs=programs,
            operating=OperatingCommands(config, servos, programs, self.publisher),
        )
        if self._learn is not None:
            verdict = self.desk.objection(self._learn.axes, self._learn.learner)
            if not verdict.accepted:
                raise LearningError(verdict.reason)
        self._link: MqttLink | None = None
        if config.mqtt is not None:
            axis_names, stream = list(config.axes), None
            if config.mqtt.stream:
                stream = RowStream(axis_names, config.period_s, config.mqtt.stream_hz)
                self.rows.stream = stream.take
            self._link = link = MqttLink(
                config.mqtt, config.machine.name, self.desk, stream=stream, note=self.note
            )
            self.publisher.on_change.append(link.changed)
            self.publisher.on_reversal.append(lambda axis, report, _trace_m: link.reversal(axis, report))
            self.publisher.on_due.append(link.due)

    @property
    def completed(self) -> bool:
        """What the run was for has been done: learning, or else the program."""
        return self._motion.completed if self._learn is None else self.job.state is LearningState.DONE

    @property
    def problem(self) -> str:
        """Why what was to be learned was not, although nothing stopped the machine; else ""."""
        stopped = self._machine is not None and self._machine.reason
        if self._learn is None or self.completed or stopped:
            return ""
        return self.job.status().reason

    def attach(self, assembly: Assembly) -> None:
        """The machine is there."""
        self._assembly = assembly
        assembly.machine.served, assembly.machine.stand_by = self._served, self._stand_by
        if self._stand_by and self._begun:
            assembly.machine.wait_for_the_operator()
        self.job.attach(assembly.machine)
        self.desk.attach(assembly)
        for problem in self._problems:
            self.note(problem)

    def on_ready(self) -> None:
        """The axes are led: do what the run is for."""
        machine = self._machine
        if machine is None:
            return
        begun, self._begun = self._begun, True
        if begun:
            self.publisher.changed()
            return
        if self._learn is not None:
            verdict = self.desk.learn(self._learn.axes, self._learn.learner, fresh=self._learn.fresh)
            if not verdict.accepted:
                machine.event(Event.BAD_PROGRAM, verdict.reason)
        else:
            self._program.first(machine)
        self.publisher.changed()

    def on_rest(self) -> None:
        """A program or a stroke is over and the axes stand, or the machine is in standby."""
        self.job.on_rest()
        self._finish()
        self.publisher.changed()

    def on_stop(self, reason: str) -> None:
        """The machine stops."""
        self._begun = True
        self.job.on_stop(reason)
        self.publisher.changed()

    def note(self, text: str) -> None:
        """Something worth a line in the report."""
        if self._machine is not None:
            self._machine.note(text)

    def tasks(self) -> list[Coroutine[None, None, None]]:
        """What runs beside the cycle until it is cancelled."""
        return [self.worker.run(), *([self._link.run()] if self._link is not None else [])]

    async def finish(self) -> None:
        """Store what was learned in production, and let the worker do what it still has."""
        self.adaptation.store()
        try:
            async with asyncio.timeout(FINISH_LIMIT_S):
                await self.worker.finish()
        except TimeoutError:
            self.note(f"what was still to be stored was not, within {FINISH_LIMIT_S:g} s: the disk hangs")

    @property
    def _machine(self) -> Machine | None:
        return self._assembly.machine if self._assembly is not None else None

    def _on_learning_end(self) -> None:
        if self._learn is not None:
            self._over = True
            self._finish()

    def _finish(self) -> None:
        if self._over and self._machine is not None:
            self._machine.finish()
