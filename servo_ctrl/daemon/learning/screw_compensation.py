"""Selects the screw table and lost motion that act on each axis, stored or on trial.

While a screw is learned neither its stored table nor the sampled dual loop acts, because both would hide the
error to be measured.
"""

from pathlib import Path

from servo_ctrl.axis.servo import AxisServo
from servo_ctrl.config.kernel_params import with_sampled_dual_loop, with_screw
from servo_ctrl.config.model import AxisConfig
from servo_ctrl.control.compensation.sampled_dual_loop import SampledDualLoopSettings
from servo_ctrl.control.compensation.screw_error import ScrewCompensationSettings
from servo_ctrl.daemon.learning.learned_compensation import Compensation, LearnedCompensation
from servo_ctrl.learned.store import StoredResult
from servo_ctrl.learning.screw import ScrewLearned, error_table
from servo_ctrl.learning.screw_travel import ScrewTravel


class ScrewCompensation(LearnedCompensation[ScrewTravel]):
    """Screw table, backlash take-up and sampled dual loop of one axis. A trial is a learning travel."""

    result, settings = "screw", ScrewCompensationSettings

    def __init__(self, servo: AxisServo, config: AxisConfig) -> None:
        super().__init__(servo, config)
        self.sampled = config.acts(SampledDualLoopSettings)
        self.stored: StoredResult[ScrewLearned] | None = None
        """The stored version in use."""

    def use(self, stored: StoredResult[ScrewLearned] | None) -> None:
        """Use a stored version; None = no compensation."""
        self.problem, self.stored = "", stored
        self._apply()

    def switch(self, *, on: bool) -> None:
        """Switch screw table and backlash take-up on or off."""
        self.enabled = on
        self._apply()

    def begin_as(self, wanted: Compensation, _machine_file: Path) -> None:
        """Switch everything off if `wanted` is "off"."""
        if wanted == "off":
            self.sampled = False
            self.switch(on=False)

    def _apply(self) -> None:
        table, lost_motion_m, sampled = None, 0.0, self.sampled
        if self._trial is not None:
            table, lost_motion_m, sampled = self._trial.table, self._trial.lost_motion_m, False
        elif self.enabled and self.stored is not None:
            table, lost_motion_m = error_table(self.stored.learned), self.stored.learned.lost_motion_m
        self._servo.change_params(
            with_sampled_dual_loop(with_screw(self._servo.params, table, lost_motion_m), sampled)
        )
