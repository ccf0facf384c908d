"""One axis learning its screw: travels to be made, and the store for their result.

There is no journal: a run takes minutes, and the zero of the scale is set anew whenever the controller takes
the axes over, so that travels of two runs do not belong together. Whoever leaves off begins anew.
"""

from collections.abc import Sequence
from typing import Any

from servo_ctrl.config.learning import screw_settings
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.learning.axis_learning import ADVICE, REPEATS, UM, LearningError, LearningOutcome
from servo_ctrl.daemon.learning.collectors import Collector, TravelCollector
from servo_ctrl.daemon.learning.screw_compensation import ScrewCompensation
from servo_ctrl.daemon.set_points.motion_plan import MotionPlan
from servo_ctrl.daemon.set_points.reference import ProgramReference
from servo_ctrl.learned.store import ScrewStore, StoredResult
from servo_ctrl.learning.screw import ScrewLearned, ScrewRun
from servo_ctrl.learning.screw_travel import ScrewTravel, deviations_m, passes_of
from servo_ctrl.learning.types import Outlook


class ScrewLearning:
    """See `learner.AxisLearning`."""

    resumed = 0

    def __init__(
        self, config: MachineConfig, store: ScrewStore, screw: ScrewCompensation, motion: MotionPlan
    ) -> None:
        self.name = screw.name
        self._config, self._store, self._screw, self._motion = config, store, screw, motion
        self._settings = screw_settings(config, screw.name)
        self._run = ScrewRun(self._settings)
        self._spoilt = 0

    @property
    def stroke(self) -> ScrewTravel | None:
        """The next travel, None when all is learned."""
        return self._run.stroke

    @property
    def outlook(self) -> Outlook:
        """How far it is."""
        return self._run.outlook

    def open(self, *, fresh: bool) -> list[str]:
        """It always begins anew."""
        del fresh
        return []

    def prepare(self, start_m: Sequence[float]) -> ProgramReference:
        """The motion of the travel. Raises ConfigError."""
        return self._motion.prepare_travel(self.name, start_m)

    def begin(self) -> Collector:
        """The travel begins: it alone says what compensates."""
        if self._run.stroke is not None:
            self._screw.try_out(self._run.stroke)
        return TravelCollector(self._config, self.name)

    def restore(self) -> None:
        """What was in use before acts again."""
        self._screw.restore()

    def take(self, collected: Collector) -> str:
        """The samples of the travel; "" when they are good, else why it must be made again.

        Raises LearningError when it was made again too often, or all of them together cannot be used.
        """
        try:
            command_m, correction_m, motor_m, scale_m = collected.columns()
            up, down = passes_of(command_m, correction_m, motor_m, scale_m, self._settings)
            found_m = deviations_m(up, down, self._settings)
        except ValueError as error:
            self._spoilt += 1
            if self._spoilt > REPEATS:
                text = f"axis {self.name}: {self._spoilt} travels in a row are spoilt: {error}; {ADVICE}"
                raise LearningError(text) from None
            return f"axis {self.name}: a travel is made again: {error}"
        self._spoilt = 0
        try:
            self._run.take(found_m)
        except ValueError as error:
            raise LearningError(f"axis {self.name}: {error}") from None
        return ""

    def conclude(self) -> StoredResult[ScrewLearned]:
        """Store what was learned. Raises LearningError when it is no better than nothing, and StoreError."""
        learned = self._run.learned
        if learned is None or self._run.stroke is not None:
            raise LearningError(f"axis {self.name}: learning is not at its end")
        if not learned.after_m < learned.before_m:
            raise LearningError(
                f"axis {self.name}: what was learned is no better and is not used: J is "
                f"{learned.before_m * UM:.2f} um without it, {learned.after_m * UM:.2f} um with it"
            )
        return self._store.add(self.name, learned, self._conditions())

    def use(self, result: StoredResult[ScrewLearned]) -> LearningOutcome:
        """Take it into use."""
        self._screw.use(result)
        return LearningOutcome(self.name, result.version, result.learned, self.resumed)

    def discard(self) -> None:
        """There is nothing on the disk."""

    def _conditions(self) -> dict[str, Any]:
        settings = self._settings
        return {
            "source": "learning",
            "mode": self._config.axes[self.name].mode,
            "feed_m_s": settings.feed_m_s,
            "travels": settings.travels,
            "step_m": settings.step_m,
            "temperature": "not measured",
        }
