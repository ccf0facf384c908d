"""Learns the waveform of one axis: its strokes and the store of their result.

There is no journal: an interrupted run starts again.
"""

from collections.abc import Sequence

from servo_ctrl.config.learning import waveform_settings
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.learning.axis_learning import AxisLearning
from servo_ctrl.daemon.learning.collectors import Collector, waveform_collector
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

    def __init__(
        self,
        config: MachineConfig,
        store: WaveformStore,
        waveform: WaveformCompensation,
        pulse: AxisCompensation,
        motion: MotionPlan,
    ) -> None:
        super().__init__(config, store, waveform, motion)
        self._pulse = pulse
        self._settings = waveform_settings(config, waveform.name)
        self._publish_progress(WaveformRun(self._settings))

    def prepare(self, start_m: Sequence[float]) -> ProgramReference:
        """Plan the motion of `stroke`. Raises ConfigError."""
        return self._motion.prepare_stroke(self.name, self.stroke.sine, start_m)

    def begin(self) -> Collector:
        """Begin `stroke` and apply only its force, neither pulse nor observer."""
        self._pulse.try_out(NO_PULSE)
        self._compensation.try_out(self.stroke)
        return waveform_collector(self._config, self.name)

    def restore(self) -> None:
        """Restore the compensation in use before the stroke."""
        super().restore()
        self._pulse.restore()

    def _evaluate(self, collected: Collector) -> WaveformResult:
        command_m, velocity_m_s, error_m = collected.samples()
        return waveform_result(command_m, velocity_m_s, error_m, self.stroke.sine, self._settings)

    def _store_result(self, learned: WaveformLearned) -> StoredResult[WaveformLearned]:
        return self._store.add(self.name, learned, conditions_of(self._config, self.name, "learning"))
