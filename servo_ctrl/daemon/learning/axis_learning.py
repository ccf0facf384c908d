"""What a learning run is made of, whatever an axis learns: see `learning_job`."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, NamedTuple

from servo_ctrl.daemon.learning.collectors import Collector
from servo_ctrl.daemon.set_points.reference import ProgramReference
from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.learning.schedule import LearningRun
from servo_ctrl.learning.screw import ScrewLearned, ScrewRun
from servo_ctrl.learning.types import Learned, Outlook
from servo_ctrl.units import UM

REPEATS = 5
"""Strokes in a row that a late tick or a lost input may spoil before learning gives up; chosen."""
ADVICE = "run `servo-ctrl learn --fifo`, give this computer less to do, or look for frames that are lost"


class LearningError(ServoCtrlError):
    """Learning cannot go on, or its result is not used."""


class LearningOutcome(NamedTuple):
    """An axis that was learned, and whose new result is in use."""

    axis: str
    version: int
    learned: Learned | ScrewLearned
    resumed: int
    """Strokes that an earlier run had made."""


class AxisLearning(ABC):
    """One axis learning something, stroke by stroke.

    `open`, `prepare`, `take`, `conclude` and `discard` may take longer than a period: the background worker
    calls them, and they may raise ServoCtrlError.
    """

    stroke_noun: str
    """What messages call a stroke."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.stroke: Any = None
        """The next motion to make; None when all is learned."""
        self.outlook: Outlook | None = None
        """How far it is."""
        self.resumed = 0
        """Strokes that an earlier run had made."""
        self._run: LearningRun | ScrewRun | None = None
        self._spoilt = 0

    @abstractmethod
    def open(self, *, fresh: bool) -> list[str]:
        """Begin, or go on where an earlier run left off unless `fresh`; return notes for the report."""

    @abstractmethod
    def prepare(self, start_m: Sequence[float]) -> ProgramReference:
        """Plan the motion of `stroke` from where the axes stand."""

    @abstractmethod
    def begin(self) -> Collector:
        """Begin `stroke`: what it tries out acts from now on. Return the collector of its samples."""

    @abstractmethod
    def restore(self) -> None:
        """Let what was in use before act again, as the stroke is over, or learning."""

    def take(self, collected: Collector) -> str:
        """Take the samples of `stroke`; "" when they are good, else why it must be made again.

        Raises LearningError when it was made again too often.
        """
        try:
            result = self._evaluate(collected)
        except ValueError as error:
            self._spoilt += 1
            if self._spoilt > REPEATS:
                in_a_row = f"{self._spoilt} {self.stroke_noun}s in a row are spoilt"
                raise LearningError(f"axis {self.name}: {in_a_row}: {error}; {ADVICE}") from None
            return f"axis {self.name}: a {self.stroke_noun} is made again: {error}"
        self._spoilt = 0
        self._advance(result)
        return ""

    def conclude(self) -> Any:
        """Store what was learned. Raises LearningError when it is no better than nothing."""
        learned = None if self._run is None else self._run.learned
        if learned is None or self.stroke is not None:
            raise LearningError(f"axis {self.name}: learning is not at its end")
        if not learned.after_m < learned.before_m:
            self.discard()
            raise LearningError(
                f"axis {self.name}: what was learned is no better and is not used: J is "
                f"{learned.before_m / UM:.2f} um without it, {learned.after_m / UM:.2f} um with it"
            )
        return self._store_result(learned)

    @abstractmethod
    def use(self, result: Any) -> LearningOutcome:
        """Take what `conclude` gave into use."""

    def discard(self) -> None:  # noqa: B027  # nothing to forget is the usual case
        """Forget the strokes made so far."""

    @abstractmethod
    def _evaluate(self, collected: Any) -> Any:
        """Evaluate the samples of `stroke`. Raises ValueError when they are spoilt."""

    @abstractmethod
    def _advance(self, result: Any) -> None:
        """Go on to the next stroke with the result of this one."""

    @abstractmethod
    def _store_result(self, learned: Any) -> Any:
        """Store what was learned; return what `use` takes."""

    def _now_at(self, run: LearningRun | ScrewRun) -> None:
        """Show where the run is: in the thread of the cycle these are read while the worker changes it."""
        self._run, self.stroke, self.outlook = run, run.stroke, run.outlook
