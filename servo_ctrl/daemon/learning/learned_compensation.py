"""What the learned compensations of an axis share: loading a stored result, and a trial that replaces it.

An unusable result (damaged, stale, of another machine, other gains or another home) is reported and not used.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, ClassVar, Generic, Literal, TypeVar

from servo_ctrl.axis.servo import AxisServo
from servo_ctrl.config.model import AxisConfig, MachineConfig
from servo_ctrl.errors import ServoCtrlError

Compensation = Literal["as configured", "off", "pulse", "observer", "waveform"]
"""What acts from the start: as in the machine file, nothing, or only pulse, observer or waveform."""
Trial = TypeVar("Trial")


class CompensationError(ServoCtrlError):
    """The requested compensation cannot act."""


class LearnedCompensation(ABC, Generic[Trial]):
    """One kind of compensation of one axis; a change acts from the next cycle on."""

    result: ClassVar[str]
    """Name of the learned result in messages."""
    settings: ClassVar[type[Any]]
    """Type of its section in the machine file."""

    def __init__(self, servo: AxisServo, config: AxisConfig) -> None:
        self.name = servo.name
        self.configured = config.section(self.settings) is not None
        """Whether the machine file has the section."""
        self.enabled = config.acts(self.settings)
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

    @abstractmethod
    def begin_as(self, wanted: Compensation, machine_file: Path) -> None:
        """Switch it as `wanted` from the start. Raises CompensationError where the axis lacks that."""

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


Kind = TypeVar("Kind", bound=LearnedCompensation[Any])


def loaded(
    kind: type[Kind],
    machine: MachineConfig,
    servos: Sequence[AxisServo],
    active: Callable[[str], Any],
    wanted: Compensation,
) -> dict[str, Kind]:
    """Load the version of each axis that `active` returns, and switch it as `wanted`; by axis.

    Raises CompensationError.
    """
    axes = {}
    for servo in servos:
        axis = axes[servo.name] = kind(servo, machine.axes[servo.name])
        if axis.configured:
            axis.load(active)
        axis.begin_as(wanted, machine.source)
    return axes
