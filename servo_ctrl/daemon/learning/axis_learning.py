"""What a learning run is made of, whatever an axis learns: see `learning_job`."""

from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

from servo_ctrl.daemon.learning.collectors import Collector
from servo_ctrl.daemon.set_points.reference import ProgramReference
from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.learning.screw import ScrewLearned
from servo_ctrl.learning.types import Learned, Outlook

UM = 1e6
REPEATS = 5
"""So many strokes in a row may be spoilt, by a late tick or a lost input, before learning gives up."""
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


class AxisLearning(Protocol):
    """One axis learning something, stroke by stroke.

    `open`, `prepare`, `take`, `conclude` and `discard` may take longer than a period: the background worker
    calls them, and they may raise ServoCtrlError.
    """

    name: str

    @property
    def stroke(self) -> object:
        """The next motion to make; None when all is learned."""

    @property
    def outlook(self) -> Outlook | None:
        """How far it is."""

    def open(self, *, fresh: bool) -> list[str]:
        """Begin, or go on where an earlier run left off unless `fresh`; what there is to say."""

    def prepare(self, start_m: Sequence[float]) -> ProgramReference:
        """The motion of `stroke` from where the axes stand."""

    def begin(self) -> Collector:
        """`stroke` begins: what it tries out acts; who takes its samples."""

    def restore(self) -> None:
        """The stroke is over, or learning: what was in use before acts again."""

    def take(self, collected: Collector) -> str:
        """The samples of `stroke`; "" when they are good, else why it must be made again."""

    def conclude(self) -> Any:
        """Store what was learned."""

    def use(self, result: Any) -> LearningOutcome:
        """Take what `conclude` gave into use."""

    def discard(self) -> None:
        """Forget the strokes made so far."""
