"""Learns the waveform of one axis: its strokes and the store of their result.

There is no journal: an interrupted run starts again.
"""

from collections.abc import Sequence

from servo_ctrl.config.learning import waveform_settings
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.learning.axis_learning import AxisLearning, LearningOutcome
from servo_ctrl.daemon.learning.collectors import WaveformCollector
from servo_ctrl.daemon.learning.pulse_compensation import AxisCompensation
from servo_ctrl.daemon.learning.pulse_learning import conditions_of
from servo_ctrl.daemon.learning.waveform_compensation import WaveformCompensation
from servo_ctrl.daemon.set_points.motion_plan import MotionPlan
from servo_ctrl.daemon.set_points.reference import ProgramReference
from servo_ctrl.learned.store import StoredResult, WaveformStore
from servo_ctrl.learning.reversal_waveform import WaveformLearned
from servo_ctrl.learning.types import NO_PULSE
from servo_ctrl.learning.waveform_run import WaveformRun
from servo_ctrl.learning.waveform_stroke import WaveformResult, waveform_result


class WaveformLearning(AxisLearning):
    """Learns friction with memory, and the additional waveform, of one axis."""

    stroke_noun = "stroke"
    _run: WaveformRun

    def __init__(
        self,
        config: MachineConfig,
        store: WaveformStore,
        waveform: WaveformCompensation,
        pulse: AxisCompensation,
        motion: MotionPlan,
    ) -> None:
        super().__init__(waveform.name)
        self._config, self._store, self._motion = config, store, motion
        self._waveform, self._pulse = waveform, pulse
        self._settings = waveform_settings(config, waveform.name)
        self._publish_progress(WaveformRun(self._settings))

    def open(self, *, fresh: bool) -> list[str]:
        """Do nothing: a waveform run cannot be resumed."""
        del fresh
        return []

    def prepare(self, start_m: Sequence[float]) -> ProgramReference:
        """Plan the motion of `stroke`. Raises ConfigError."""
        return self._motion.prepare_stroke(self.name, self.stroke.sine, start_m)

    def begin(self) -> WaveformCollector:
        """Begin `stroke` and apply only its force, neither pulse nor observer."""
        self._pulse.try_out(NO_PULSE)
        self._waveform.try_out(self.stroke)
        return WaveformCollector(self._config, self.name)

    def restore(self) -> None:
        """Restore the compensation in use before the stroke."""
        self._waveform.restore()
        self._pulse.restore()

    def _evaluate(self, collected: WaveformCollector) -> WaveformResult:
        return waveform_result(*collected.samples(), self.stroke.sine, self._settings)

    def _advance(self, result: WaveformResult) -> None:
        self._run.take(result)
        self._publish_progress(self._run)

    def _store_result(self, learned: WaveformLearned) -> StoredResult[WaveformLearned]:
        return self._store.add(self.name, learned, conditions_of(self._config, self.name, "learning"))

    def use(self, result: StoredResult[WaveformLearned]) -> LearningOutcome:
        """Put the stored waveform into use."""
        self._waveform.use(result)
        return LearningOutcome(self.name, result.version, result.learned, self.resumed)
