"""Learns the pulse of one axis: the run, its journal for resumption, and the store of its result."""

from collections.abc import Sequence
from typing import Any

from servo_ctrl.config.learning import learning_settings
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.learning.axis_learning import AxisLearning, LearningOutcome
from servo_ctrl.daemon.learning.collectors import Collector, stroke_collector
from servo_ctrl.daemon.learning.pulse_compensation import AxisCompensation, Functions
from servo_ctrl.daemon.learning.waveform_compensation import WaveformCompensation
from servo_ctrl.daemon.set_points.motion_plan import MotionPlan
from servo_ctrl.daemon.set_points.reference import ProgramReference
from servo_ctrl.learned.pulse_model import LearnedFunctions
from servo_ctrl.learned.store import LearnedStore
from servo_ctrl.learned.stroke_journal import StrokeJournal
from servo_ctrl.learning.pulse_functions import table
from servo_ctrl.learning.schedule import LearningRun
from servo_ctrl.learning.stroke_result import stroke_result
from servo_ctrl.learning.types import Learned, StrokeResult


class PulseLearning(AxisLearning):
    """Learns the pulse functions of one axis."""

    stroke_noun = "stroke"

    def __init__(
        self,
        config: MachineConfig,
        learner: str,
        store: LearnedStore,
        compensation: AxisCompensation,
        motion: MotionPlan,
        waveform: WaveformCompensation,
    ) -> None:
        super().__init__(config, store, compensation, motion)
        self._waveform = waveform
        self._settings = learning_settings(config, self.name, learner)
        self._journal = StrokeJournal(
            store.directory, self.name, self._settings, basis=LearnedFunctions.basis(config, self.name)
        )

    def open(self, *, fresh: bool) -> list[str]:
        """Begin, or resume from the journal unless `fresh`; return texts of events. Raises StoreError."""
        if fresh:
            self._journal.remove()
        run, notes = LearningRun(self._settings), []
        entries = self._journal.replay()
        if self._journal.problem:
            notes.append(f"axis {self.name}: {self._journal.problem}")
        for stroke, result in entries:
            if stroke != run.stroke:
                notes.append(
                    f"axis {self.name}: {self._journal.path}: other strokes than would be made now; "
                    "learning starts again"
                )
                self._journal.remove()
                run, entries = LearningRun(self._settings), []
                break
            run.take(result)
        self.resumed = len(entries)
        if entries:
            notes.append(f"axis {self.name}: learning goes on after {len(entries)} strokes made before")
        self._publish_progress(run)
        return notes

    def prepare(self, start_m: Sequence[float]) -> ProgramReference:
        """Plan the motion of `stroke`. Raises ConfigError."""
        return self._motion.prepare_stroke(self.name, self.stroke, start_m)

    def begin(self) -> Collector:
        """Begin `stroke` and apply its pulse, without a learned waveform."""
        self._compensation.try_out(self.stroke.pulse)
        self._waveform.suspend(on=True)
        return stroke_collector(self._config, self.name)

    def restore(self) -> None:
        """Restore the compensation in use before the stroke."""
        super().restore()
        self._waveform.suspend(on=False)

    def _evaluate(self, collected: Collector) -> StrokeResult:
        command_m, position_m = collected.samples()
        return stroke_result(command_m, position_m, self.stroke, self._settings, self._config.period_s)

    def _advance(self, result: StrokeResult) -> None:
        self._journal.append(self.stroke, result)
        super()._advance(result)

    def _store_result(self, learned: Learned) -> Functions:
        conditions = conditions_of(self._config, self.name, "learning")
        stored = self._store.add(self.name, learned, {**conditions, "strokes_resumed": self.resumed})
        self._journal.remove()
        return Functions(stored, table(learned))

    def use(self, result: Functions) -> LearningOutcome:
        """Put the stored functions into use."""
        self._compensation.use(result)
        return LearningOutcome(self.name, result.stored.version, result.stored.learned, self.resumed)

    def discard(self) -> None:
        """Discard the strokes made so far. Raises StoreError."""
        self._journal.remove()


def conditions_of(config: MachineConfig, axis: str, source: str) -> dict[str, Any]:
    """Return the conditions stored beside a result; the store adds gains and other dependencies."""
    limits = config.axes[axis].limits
    return {
        "source": source,
        "radius_mm": config.learning.radius_mm,
        "window_s": config.monitoring.window_s,
        "velocity_limit_mm_s": limits.velocity_mm_s,
        "acceleration_limit_mm_s2": limits.acceleration_mm_s2,
        "force_limit_n": limits.force_n,
        "temperature": "not measured",
    }
