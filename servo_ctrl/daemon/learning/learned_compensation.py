"""What the learned compensations of an axis share: loading a stored result, and a trial that replaces it."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, ClassVar, Generic, TypeVar

from servo_ctrl.axis.servo import AxisServo
from servo_ctrl.errors import ServoCtrlError

Trial = TypeVar("Trial")


class LearnedCompensation(ABC, Generic[Trial]):
    """One kind of compensation of one axis; a change acts from the next cycle on."""

    result: ClassVar[str]
    """Name of the learned result in messages."""

    def __init__(self, servo: AxisServo) -> None:
        self.name = servo.name
        self.problem = ""
        """Why the stored version is not used, else ""."""
        self._servo = servo
        self._trial: Trial | None = None

    @property
    def suspended(self) -> bool:
        """Whether it does not act at present, even if it is switched on: a tuning tries other parameters."""
        return self._servo.on_trial

    @abstractmethod
    def use(self, stored: Any) -> None:
        """Use a stored version; None = no compensation."""

    def load(self, active: Callable[[str], Any]) -> None:
        """Use the version that `active` returns for the axis; note in `problem` why it cannot be used."""
        try:
            self.use(active(self.name))
        except ServoCtrlError as error:
            self.problem = f"axis {self.name} runs without its learned {self.result}: {error}"

    def try_out(self, trial: Trial) -> None:
        """Apply this trial of a learning motion instead of the stored result, until `restore`."""
        self._trial = trial
        self._apply()

    def restore(self) -> None:
        """Restore the compensation in use before the trial."""
        if self._trial is not None:
            self._trial = None
            self._apply()

    @abstractmethod
    def _apply(self) -> None:
        """Pass what acts now to the control law of the axis."""
