"""Learns the screw error of one axis: its travels and the store of their result.

There is no journal: a run takes minutes, and each take-over of the axes sets a new zero of the scale, so
travels of two runs cannot be combined. An interrupted run starts again.
"""

from collections.abc import Sequence

from kernels.arrays import Array
from servo_ctrl.config.learning import screw_settings
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.learning.axis_learning import AxisLearning, LearningError
from servo_ctrl.daemon.learning.collectors import Collector, travel_collector
from servo_ctrl.daemon.learning.screw_compensation import ScrewCompensation
from servo_ctrl.daemon.set_points.motion_plan import MotionPlan
from servo_ctrl.daemon.set_points.reference import ProgramReference
from servo_ctrl.learned.store import ScrewStore, StoredResult
from servo_ctrl.learning.screw import ScrewLearned, ScrewRun
from servo_ctrl.learning.screw_travel import deviations_m, passes_of


class ScrewLearning(AxisLearning):
    """Learns screw table and lost motion of one axis."""

    stroke_noun = "travel"

    def __init__(
        self, config: MachineConfig, store: ScrewStore, screw: ScrewCompensation, motion: MotionPlan
    ) -> None:
        super().__init__(config, store, screw, motion)
        self._settings = screw_settings(config, screw.name)
        self._publish_progress(ScrewRun(self._settings))

    def prepare(self, start_m: Sequence[float]) -> ProgramReference:
        """Plan the motion of `stroke`, a travel. Raises ConfigError."""
        return self._motion.prepare_travel(self.name, start_m)

    def begin(self) -> Collector:
        """Begin the travel and apply only its compensation."""
        self._compensation.try_out(self.stroke)
        return travel_collector(self._config, self.name)

    def _evaluate(self, collected: Collector) -> Array:
        command_m, correction_m, motor_m, scale_m = collected.columns()
        up, down = passes_of(command_m, correction_m, motor_m, scale_m, self._settings)
        return deviations_m(up, down, self._settings)

    def _advance(self, result: Array) -> None:
        try:
            super()._advance(result)
        except ValueError as error:  # the travels together give no usable result
            raise LearningError(f"axis {self.name}: {error}") from None

    def _store_result(self, learned: ScrewLearned) -> StoredResult[ScrewLearned]:
        conditions = {
            "source": "learning",
            "mode": self._config.axes[self.name].mode,
            "feed_m_s": self._settings.feed_m_s,
            "travels": self._settings.travels,
            "step_m": self._settings.step_m,
            "temperature": "not measured",
        }
        return self._store.add(self.name, learned, conditions)
