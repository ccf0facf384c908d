"""The result of a tuning: the measured plant, the setting before and after, and the proposal."""

from typing import NamedTuple

from servo_ctrl.control.axis_loop import Plant
from servo_ctrl.control.modal_model import ModalModel
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.excitation.measuring_motion import Plan
from servo_ctrl.tuning.frequency_response import FrequencyResponse
from servo_ctrl.tuning.loop import Margins
from servo_ctrl.tuning.machine_file import Sections
from servo_ctrl.tuning.proposal import Proposal
from servo_ctrl.tuning.trial import StepAndMove, Traces

MS_TOLERANCE = 1.03
"""Bounds measured over stated Ms of a proved proposal. Chosen: about the error of a measurement."""


class AssessedSetting(NamedTuple):
    """One setting of an axis: its margins on the measured plant, and its trial on the machine."""

    params: AxisParams
    plant: Plant
    margins: Margins
    compliance_m_n: float
    """Peak of |P / (1 + L)|."""
    trial: StepAndMove | None
    """None if the machine was not moved with this setting, or the run ended early."""
    traces: Traces | None
    remark: str
    """Why there is no trial, else ""."""


class TuneResult(NamedTuple):
    """Everything that a report shows."""

    machine: str
    axis: str
    ms: float
    """The stated largest sensitivity peak."""
    plan: Plan
    response: FrequencyResponse
    """Measured with gains at which the axis stands still at rest."""
    model: ModalModel
    before: AssessedSetting
    after: AssessedSetting
    verified: FrequencyResponse
    """Measured with the proposed values."""
    measured_ms: float
    """Largest |1 / (1 + L)| of `verified`."""
    proposal: Proposal
    sections: Sections
    notes: tuple[str, ...]
    simulated: bool = False
    """On hil-sim instead of the machine."""

    @property
    def proved(self) -> bool:
        """Whether the proposal kept the stated Ms on the machine, and the axis stood still at rest."""
        trial = self.after.trial
        return trial is not None and not trial.hums and self.measured_ms <= self.ms * MS_TOLERANCE
