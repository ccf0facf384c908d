"""One axis learning its pulse: the run, the journal that it can be resumed from, the store for its result."""

from collections.abc import Sequence
from typing import Any

from servo_ctrl.config.learning import learning_settings
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.learning.axis_learning import ADVICE, REPEATS, UM, LearningError, LearningOutcome
from servo_ctrl.daemon.learning.collectors import Collector, StrokeCollector
from servo_ctrl.daemon.learning.pulse_compensation import AxisCompensation, Functions
from servo_ctrl.daemon.set_points.motion_plan import MotionPlan
from servo_ctrl.daemon.set_points.reference import ProgramReference
from servo_ctrl.learned.pulse_model import LearnedFunctions
from servo_ctrl.learned.store import LearnedStore
from servo_ctrl.learned.stroke_journal import StrokeJournal
from servo_ctrl.learning.pulse_functions import table
from servo_ctrl.learning.schedule import LearningRun
from servo_ctrl.learning.stroke_result import stroke_result
from servo_ctrl.learning.types import Outlook, Stroke


class PulseLearning:
    """See `learner.AxisLearning`."""

    def __init__(
        self,
        config: MachineConfig,
        learner: str,
        store: LearnedStore,
        compensation: AxisCompensation,
        motion: MotionPlan,
    ) -> None:
        axis = self.name = compensation.name
        self.stroke: Stroke | None = None
        self.outlook: Outlook | None = None
        self.resumed = 0
        """Strokes that were made before, by an earlier run."""
        self._config, self._store, self._compensation, self._motion = config, store, compensation, motion
        self._settings = learning_settings(config, axis, learner)
        self._journal = StrokeJournal(
            store.directory, axis, self._settings, basis=LearnedFunctions.basis(config, axis)
        )
        self._run: LearningRun | None = None
        self._spoilt = 0

    def open(self, *, fresh: bool) -> list[str]:
        """Begin, or go on where the journal ends; what there is to say about it.

        `fresh`: forget what was begun. Raises StoreError.
        """
        if fresh:
            self._journal.remove()
        run, said = LearningRun(self._settings), []
        entries = self._journal.replay()
        if self._journal.problem:
            said.append(f"axis {self.name}: {self._journal.problem}")
        for stroke, result in entries:
            if stroke != run.stroke:
                said.append(
                    f"axis {self.name}: {self._journal.path}: other strokes than would be made now; "
                    "learning begins anew"
                )
                self._journal.remove()
                run, entries = LearningRun(self._settings), []
                break
            run.take(result)
        self.resumed = len(entries)
        if entries:
            said.append(f"axis {self.name}: learning goes on after {len(entries)} strokes made before")
        self._now_at(run)
        return said

    def prepare(self, start_m: Sequence[float]) -> ProgramReference:
        """The motion of `stroke`. Raises ConfigError."""
        if self.stroke is None:
            raise LearningError(f"axis {self.name}: all strokes have been made")
        return self._motion.prepare_stroke(self.name, self.stroke, start_m)

    def begin(self) -> Collector:
        """`stroke` begins, with its pulse."""
        if self.stroke is not None:
            self._compensation.try_out(self.stroke.pulse)
        return StrokeCollector(self._config, self.name)

    def restore(self) -> None:
        """What was in use before acts again."""
        self._compensation.restore()

    def take(self, collected: Collector) -> str:
        """The samples of `stroke`; "" when they are good, else why it must be made again.

        Raises StoreError, and LearningError when it was made again too often.
        """
        run, stroke = self._run, self.stroke
        if run is None or stroke is None or not isinstance(collected, StrokeCollector):
            raise LearningError(f"axis {self.name}: a stroke that was not asked for")
        try:
            command_m, position_m = collected.samples()
            result = stroke_result(command_m, position_m, stroke, self._settings, self._config.period_s)
        except ValueError as error:
            self._spoilt += 1
            if self._spoilt > REPEATS:
                text = f"axis {self.name}: {self._spoilt} strokes in a row are spoilt: {error}; {ADVICE}"
                raise LearningError(text) from None
            return f"axis {self.name}: a stroke is made again: {error}"
        self._spoilt = 0
        self._journal.append(stroke, result)
        run.take(result)
        self._now_at(run)
        return ""

    def conclude(self) -> Functions:
        """Store what was learned. Raises LearningError when it is no better than nothing, and StoreError."""
        learned = self._run.learned if self._run is not None else None
        if learned is None:
            raise LearningError(f"axis {self.name}: learning is not at its end")
        if not learned.after_m < learned.before_m:
            self._journal.remove()
            raise LearningError(
                f"axis {self.name}: what was learned is no better and is not used: J is "
                f"{learned.before_m * UM:.2f} um without it, {learned.after_m * UM:.2f} um with it"
            )
        conditions = conditions_of(self._config, self.name, "learning")
        stored = self._store.add(self.name, learned, {**conditions, "strokes_resumed": self.resumed})
        self._journal.remove()
        return Functions(stored, table(learned))

    def use(self, result: Functions) -> LearningOutcome:
        """Take it into use."""
        self._compensation.use(result)
        return LearningOutcome(self.name, result.stored.version, result.stored.learned, self.resumed)

    def discard(self) -> None:
        """Forget the strokes made so far. Raises StoreError."""
        self._journal.remove()

    def _now_at(self, run: LearningRun) -> None:
        self._run, self.stroke, self.outlook = run, run.stroke, run.outlook


def conditions_of(config: MachineConfig, axis: str, source: str) -> dict[str, Any]:
    """What is noted beside a result; gains and what else it depends on are noted by the store itself."""
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
