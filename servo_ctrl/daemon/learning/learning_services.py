"""Makes and connects what learns: stored results, adaptation, monitoring of production, learning runs."""

from collections.abc import Callable

from kernels.arrays import Array
from servo_ctrl.commands.status_publisher import StatusPublisher
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.cycle.background_worker import BackgroundWorker
from servo_ctrl.daemon.cycle.machine import MachineController
from servo_ctrl.daemon.cycle.rows import RowRouter
from servo_ctrl.daemon.learning.adaptation import Adaptation
from servo_ctrl.daemon.learning.learned_results import LearnedResults
from servo_ctrl.daemon.learning.learning_job import LearningJob
from servo_ctrl.daemon.learning.production import Production
from servo_ctrl.daemon.learning.waveform_adaptation import WaveformAdaptation
from servo_ctrl.daemon.set_points.motion_plan import MotionPlan
from servo_ctrl.learning.types import ReversalReport


class LearningServices:
    """One of each for a run. `on_end` is called after every end of a learning run, successful or not."""

    def __init__(
        self,
        config: MachineConfig,
        machine: MachineController,
        motion: MotionPlan,
        results: LearnedResults,
        *,
        worker: BackgroundWorker,
        publisher: StatusPublisher,
        on_end: Callable[[], None],
    ) -> None:
        self.adaptation = Adaptation(config, results.pulses, results.pulse_store, worker, machine.note)
        self.waveform_adaptation = WaveformAdaptation(
            config,
            results.waveforms,
            store=results.waveform_store,
            worker=worker,
            note=machine.note,
            on=lambda: self.adaptation.on,
        )
        self._waveforms = list(results.waveforms.values())
        self.production = Production(config, publisher, note=machine.note, adapt=self._adapt)
        self.rows = RowRouter(self.production.monitor.observe)
        self.job = LearningJob(
            machine,
            lambda axis, learner: results.learning_of(axis, learner, motion),
            worker,
            self.rows,
            publisher,
            on_end=on_end,
        )

    def store(self) -> None:
        """Have the worker store what was adapted since the stored versions."""
        self.adaptation.store()
        self.waveform_adaptation.store()

    def _adapt(self, index: int, report: ReversalReport, trace_m: Array) -> None:
        """Let what acts on an axis learn from a reversal: its waveform, else its pulse."""
        if self._waveforms[index].acts:
            self.waveform_adaptation.take(index, report, trace_m)
        else:
            self.adaptation.take(index, report, trace_m)
