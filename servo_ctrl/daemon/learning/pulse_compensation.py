"""Selects the pulse functions that act on each axis, stored or on trial, and switches the observer."""

from pathlib import Path
from typing import NamedTuple

from kernels.arrays import Array
from servo_ctrl.axis.servo import AxisServo
from servo_ctrl.config.kernel_params import with_observer, with_pulse
from servo_ctrl.config.model import AxisConfig
from servo_ctrl.control.compensation.disturbance_observer import DisturbanceObserverSettings
from servo_ctrl.control.compensation.trapezoidal_pulse import FrictionCompensationSettings
from servo_ctrl.daemon.learning.learned_compensation import (
    Compensation,
    CompensationError,
    LearnedCompensation,
)
from servo_ctrl.learned.store import StoredResult
from servo_ctrl.learning.pulse_functions import constant_table, table
from servo_ctrl.learning.types import NO_PULSE, Learned, Pulse


class Functions(NamedTuple):
    """A stored result and the table of its functions."""

    stored: StoredResult[Learned]
    table: Array
    """Columns of the pulse table, (6, n); see `control.compensation.trapezoidal_pulse`."""


def tabulated(stored: StoredResult[Learned] | None) -> Functions | None:
    """Add the table for the control law to a stored result."""
    return None if stored is None else Functions(stored, table(stored.learned))


class AxisCompensation(LearnedCompensation[Pulse]):
    """Pulse and observer of one axis. A trial is a pulse at every reversal, without observer."""

    result, settings = "pulse", FrictionCompensationSettings

    def __init__(self, servo: AxisServo, config: AxisConfig) -> None:
        super().__init__(servo, config)
        self.has_observer = config.section(DisturbanceObserverSettings) is not None
        self.observer = config.acts(DisturbanceObserverSettings)
        self.stored: StoredResult[Learned] | None = None
        """The stored version on which the functions in use are based."""
        self.learned: Learned | None = None
        """The functions in use: those of `stored`, adapted or not."""
        self._table: Array | None = None

    def use(self, functions: Functions | None) -> None:
        """Use the functions of a stored version; None = no functions."""
        self.problem = ""
        if functions is None:
            self.stored = self.learned = self._table = None
            self._apply()
        else:
            self.stored = functions.stored
            self.adapt(functions.stored.learned, functions.table)

    def adapt(self, learned: Learned, functions: Array) -> None:
        """Use other functions and their table without changing `stored`."""
        self.learned, self._table = learned, functions
        self._apply()

    def switch(self, *, pulse: bool | None = None, observer: bool | None = None) -> None:
        """Switch the pulse or the observer on or off; None = unchanged."""
        self.enabled = self.enabled if pulse is None else pulse
        self.observer = self.observer if observer is None else observer
        self._apply()

    def begin_as(self, wanted: Compensation, machine_file: Path) -> None:
        """Switch pulse and observer as `wanted`; there must be the wanted one."""
        if wanted != "as configured":
            self.switch(pulse=wanted == "pulse", observer=wanted == "observer")
        if wanted == "pulse" and self.learned is None:
            reason = self.problem or f"nothing has been learned for axis {self.name} yet"
            raise CompensationError(f"there is no pulse to compensate with: {reason}")
        if wanted == "observer" and not self.has_observer:
            key = f"axis.{self.name}.disturbance_observer"
            raise CompensationError(f"{machine_file}: {key}: the section is missing")

    def _apply(self) -> None:
        functions, observer = None, self.observer
        if self._trial is not None:
            functions = constant_table(self._trial) if self._trial != NO_PULSE else None
            observer = False
        elif self.enabled:
            functions = self._table
        self._servo.change_params(with_observer(with_pulse(self._servo.params, functions), observer))
