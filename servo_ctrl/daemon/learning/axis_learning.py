"""The interface between a learning run and the learner of pulse, screw or waveform; see `learning_job`."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, NamedTuple

from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.learning.collectors import Collector
from servo_ctrl.daemon.learning.learned_compensation import LearnedCompensation
from servo_ctrl.daemon.set_points.motion_plan import MotionPlan
from servo_ctrl.daemon.set_points.reference import ProgramReference
from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.learned.store import VersionStore
from servo_ctrl.learning.reversal_waveform import WaveformLearned
from servo_ctrl.learning.schedule import LearningRun
from servo_ctrl.learning.screw import ScrewLearned, ScrewRun
from servo_ctrl.learning.types import Learned, Outlook
from servo_ctrl.learning.waveform_run import WaveformRun
from servo_ctrl.units import UM

REPEATS_MAX = 5
"""Bounds the consecutive strokes that a late tick or lost input makes unusable; chosen."""
ADVICE = "run `servo-ctrl learn --fifo`, give this computer less to do, or look for frames that are lost"


class LearningError(ServoCtrlError):
    """Learning cannot continue, or its result is not used."""


class LearningOutcome(NamedTuple):
    """The learned result of an axis, which is in use."""

    axis: str
    version: int
    learned: Learned | ScrewLearned | WaveformLearned
    resumed: int
    """Strokes taken over from an interrupted run."""


class AxisLearning(ABC):
    """Learns one result of one axis, stroke by stroke.

    The background worker calls `open`, `prepare`, `take`, `conclude` and `discard`, which may take longer
    than a period and may raise ServoCtrlError.
    """

    stroke_noun: str
    """The noun for a stroke in messages."""

    def __init__(
        self,
        config: MachineConfig,
        store: VersionStore[Any],
        compensation: LearnedCompensation[Any],
        motion: MotionPlan,
    ) -> None:
        self.name = compensation.name
        self._config, self._store, self._compensation, self._motion = config, store, compensation, motion
        self.stroke: Any = None
        """The next motion; None when learning is complete."""
        self.outlook: Outlook | None = None
        """Progress of the run."""
        self.resumed = 0
        """Strokes taken over from an interrupted run."""
        self._run: LearningRun | ScrewRun | WaveformRun | None = None
        self._consecutive_failures = 0

    def open(self, *, fresh: bool) -> list[str]:  # noqa: ARG002
        """Begin, or resume an interrupted run unless `fresh`; return texts of events. By default: begin."""
        return []

    @abstractmethod
    def prepare(self, start_m: Sequence[float]) -> ProgramReference:
        """Plan the motion of `stroke` from where the axes stand."""

    @abstractmethod
    def begin(self) -> Collector:
        """Begin `stroke` and switch its trial compensation on. Return the collector of its samples."""

    def restore(self) -> None:
        """Restore the compensation that was in use before the stroke."""
        self._compensation.restore()

    def take(self, collected: Collector) -> str:
        """Evaluate the samples of `stroke`; return why the stroke must be repeated, "" if they are good.

        Raises LearningError after too many repetitions.
        """
        try:
            result = self._evaluate(collected)
        except ValueError as error:
            self._consecutive_failures += 1
            if self._consecutive_failures > REPEATS_MAX:
                failures = f"{self._consecutive_failures} consecutive {self.stroke_noun}s are invalid"
                raise LearningError(f"axis {self.name}: {failures}: {error}; {ADVICE}") from None
            return f"axis {self.name}: a {self.stroke_noun} is repeated: {error}"
        self._consecutive_failures = 0
        self._advance(result)
        return ""

    def conclude(self) -> Any:
        """Store the learned result. Raises LearningError when it is no better than no compensation."""
        learned = None if self._run is None else self._run.learned
        if learned is None or self.stroke is not None:
            raise LearningError(f"axis {self.name}: learning is not complete")
        if not learned.after_m < learned.before_m:
            self.discard()
            raise LearningError(
                f"axis {self.name}: what was learned is no better and is not used: J is "
                f"{learned.before_m / UM:.2f} um without it, {learned.after_m / UM:.2f} um with it"
            )
        return self._store_result(learned)

    def use(self, result: Any) -> LearningOutcome:
        """Put the stored result that `conclude` returned into use."""
        self._compensation.use(result)
        return LearningOutcome(self.name, result.version, result.learned, self.resumed)

    def discard(self) -> None:  # noqa: B027  # by default there is nothing to discard
        """Discard the strokes made so far."""

    @abstractmethod
    def _evaluate(self, collected: Any) -> Any:
        """Evaluate the samples of `stroke`. Raises ValueError when they are unusable."""

    def _advance(self, result: Any) -> None:
        """Take the result of this stroke and determine the next one."""
        if self._run is not None:
            self._run.take(result)
            self._publish_progress(self._run)

    @abstractmethod
    def _store_result(self, learned: Any) -> Any:
        """Store the learned result; return the argument of `use`."""

    def _publish_progress(self, run: LearningRun | ScrewRun | WaveformRun) -> None:
        """Copy stroke and outlook, which the cycle's thread reads while the worker changes `run`."""
        self._run, self.stroke, self.outlook = run, run.stroke, run.outlook
