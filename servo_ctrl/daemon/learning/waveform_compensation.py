"""Selects the learned waveform that acts on each axis, stored, adapted or on trial.

While a waveform acts, pulse and observer do not act, regardless of their switches (see `learned_waveform`).
"""

from pathlib import Path

from servo_ctrl.axis.servo import AxisServo
from servo_ctrl.config.kernel_params import with_waveform
from servo_ctrl.config.learning import waveform_objection
from servo_ctrl.config.model import AxisConfig
from servo_ctrl.control.compensation.learned_waveform import LearnedWaveformSettings
from servo_ctrl.daemon.learning.learned_compensation import (
    Compensation,
    CompensationError,
    LearnedCompensation,
)
from servo_ctrl.learned.store import StoredResult
from servo_ctrl.learning.rest_force import rest_table
from servo_ctrl.learning.reversal_waveform import WaveformLearned, wave_table
from servo_ctrl.learning.temperature_input import TemperatureInput
from servo_ctrl.learning.waveform_stroke import WaveformStroke


class WaveformCompensation(LearnedCompensation[WaveformStroke]):
    """The waveform of one axis. A trial is the force of a learning stroke."""

    result, settings = "waveform", LearnedWaveformSettings

    def __init__(self, servo: AxisServo, config: AxisConfig) -> None:
        super().__init__(servo, config)
        self.learns = not waveform_objection(config)
        self.stored: StoredResult[WaveformLearned] | None = None
        """The stored version in use."""
        self.learned: WaveformLearned | None = None
        """The waveform in use: that of `stored`, adapted or not."""
        self.temperature = TemperatureInput()
        """Temperature of the axis's guide."""
        self._is_suspended = False

    @property
    def acts(self) -> bool:
        """Whether it acts in production."""
        return self.enabled and self.learned is not None

    def use(self, stored: StoredResult[WaveformLearned] | None) -> None:
        """Use a stored version; None = no waveform."""
        self.problem, self.stored = "", stored
        self.adapt(None if stored is None else stored.learned)

    def adapt(self, learned: WaveformLearned | None) -> None:
        """Use another waveform without changing `stored`."""
        self.learned = learned
        self._apply()

    def switch(self, *, on: bool) -> None:
        """Switch the waveform on or off."""
        self.enabled = on
        self._apply()

    def begin_as(self, wanted: Compensation, _machine_file: Path) -> None:
        """Switch the waveform as `wanted`; there must be one if it is."""
        if wanted != "as configured":
            self.switch(on=wanted == "waveform")
        if wanted == "waveform" and self.learned is None:
            reason = self.problem or f"no waveform has been learned for axis {self.name} yet"
            raise CompensationError(f"there is no waveform to compensate with: {reason}")

    def suspend(self, *, on: bool) -> None:
        """Suspend the waveform while something else is learned, or resume it."""
        self._is_suspended = on
        self._apply()

    def _apply(self) -> None:
        friction, table, rests = None, None, None
        if self._trial is not None:
            _, friction, table, rests = self._trial
        elif self.enabled and self.learned is not None and not self._is_suspended:
            friction = self.learned.friction
            table = wave_table(self.learned.accelerations_m_s2, self.learned.waves_n)
            rests = rest_table(self.learned.rests)
        self._servo.change_params(with_waveform(self._servo.params, friction, table, rests))
