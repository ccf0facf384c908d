"""Makes and connects what learns: stored results, adaptation, monitoring of production, learning runs."""

from collections.abc import Callable
from pathlib import Path

from kernels.arrays import Array
from servo_ctrl.commands.status_publisher import StatusPublisher
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.cycle.background_worker import BackgroundWorker
from servo_ctrl.daemon.cycle.machine import MachineController
from servo_ctrl.daemon.cycle.rows import RowRouter
from servo_ctrl.daemon.learning.adaptation import Adaptation
from servo_ctrl.daemon.learning.learned_results import LearnedResults
from servo_ctrl.daemon.learning.learning_job import LearningJob
from servo_ctrl.daemon.learning.monitoring import ReversalMonitor
from servo_ctrl.daemon.learning.waveform_adaptation import WaveformAdaptation
from servo_ctrl.daemon.set_points.motion_plan import MotionPlan
from servo_ctrl.learning.types import ReversalReport
from servo_ctrl.recording.reversal_log import ReversalLog, reversal_entry
from servo_ctrl.units import UM


class Production:
    """Monitors production: publishes, logs and adapts to reversals, and logs when learning is due.

    `note` logs an event; `adapt` receives axis, report and error trace (n,), metres, of every reversal.
    """

    def __init__(
        self,
        config: MachineConfig,
        publisher: StatusPublisher,
        *,
        note: Callable[[str], None],
        adapt: Callable[[int, ReversalReport, Array], None],
    ) -> None:
        self.monitor = ReversalMonitor(config, self._on_reversal, self._on_due)
        self._names = list(config.axes)
        self._due_after = config.monitoring.due_after_reversals
        self._period_s = config.period_s
        self._publisher, self._note, self._adapt = publisher, note, adapt
        self._log: ReversalLog | None = None

    def log_to(self, path: Path) -> None:
        """Also write the reversals to this file. Raises RecordingError."""
        self._log = ReversalLog(path)

    def close(self) -> None:
        """Write the remaining reversals and close the file. Blocking. Raises RecordingError."""
        if self._log is not None:
            self._log.close()

    def _on_reversal(self, axis: int, report: ReversalReport, trace_m: Array) -> None:
        self._publisher.reversal(self._names[axis], report, trace_m)
        if self._log is not None:
            due = self.monitor.due[axis]
            self._log.add(reversal_entry(report, self._names[axis], self._period_s, due=due))
        self._adapt(axis, report, trace_m)

    def _on_due(self, axis: int, due: bool) -> None:
        last, required_um = self.monitor.last[axis], self.monitor.required_m / UM
        mean_um = last.error_mean_m / UM if last is not None else 0.0
        if due:
            compared = f"J {mean_um:.1f} um over {required_um:.1f} um, {self._due_after} reversals in a row"
            self._note(f"axis {self._names[axis]}: learning is due: {compared}")
        else:
            self._note(f"axis {self._names[axis]}: learning is no longer due: J {mean_um:.1f} um")
        self._publisher.due(self._names[axis], due)


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
