"""The schema of learned pulse functions, and the machine-file values that they depend on."""

from dataclasses import asdict
from typing import Annotated, Any

from pydantic import Field, Strict, field_validator

from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.section import FileSection, NonNegative, Number, Positive
from servo_ctrl.control.compensation.fuzzy_pd import FuzzyPdSettings
from servo_ctrl.control.compensation.trapezoidal_pulse import FrictionCompensationSettings
from servo_ctrl.learned.file_model import Basis, LearnedContent
from servo_ctrl.learning.types import Learned
from servo_ctrl.units import MM

PULSE_TIME_MAX_S = 60.0
"""Bounds the times of a pulse, seconds; chosen."""
POINTS_MAX = 2000
"""Bounds the points of a function; chosen."""
_ROUNDING = 1.0 + 1e-9
"""Tolerance of A_max, which is computed in several places whose last bits may differ."""
_GAINS_ADDED_LATER = frozenset({"ki_1_s2", "kd", "derivative_filter_ms"})
"""Gains that older results lack, because the software that wrote them had no such gains; 0 = off."""

PulseTime = Annotated[float, Strict(), Field(ge=0.0, le=PULSE_TIME_MAX_S)]


class DurationPoint(FileSection):
    """One point of T*(a)."""

    acceleration_m_s2: Positive
    duration_s: Annotated[float, Strict(), Field(gt=0.0, le=PULSE_TIME_MAX_S)]


class AmplitudePoint(FileSection):
    """One point of A*(a), positive because a pulse against the new direction would increase the error."""

    acceleration_m_s2: Positive
    amplitude_m_s: Positive


class TrailingPoint(FileSection):
    """The second trapezoid at one acceleration."""

    acceleration_m_s2: Positive
    start_s: PulseTime
    duration_s: PulseTime
    amplitude_m_s: Number


class LearnedFunctions(LearnedContent):
    """`learning.types.Learned` with the points by name."""

    result = Learned
    durations: Annotated[list[DurationPoint], Field(min_length=1, max_length=POINTS_MAX)]
    amplitudes: Annotated[list[AmplitudePoint], Field(min_length=1, max_length=POINTS_MAX)]
    spread_m_s2: NonNegative
    trailing: Annotated[list[TrailingPoint], Field(max_length=POINTS_MAX)]

    @field_validator("durations", "amplitudes", "trailing")
    @classmethod
    def _rising(cls, value: list[Any]) -> list[Any]:
        accelerations = [point.acceleration_m_s2 for point in value]
        if sorted(set(accelerations)) != accelerations:
            raise ValueError("the accelerations must rise")
        return value

    @staticmethod
    def basis(machine: MachineConfig, axis: str) -> Basis:
        """Return the machine-file values that a learned pulse depends on."""
        config, pulse = machine.axes[axis], machine.axes[axis].section(FrictionCompensationSettings)
        basis: Basis = {
            "sync_period_us": machine.bus.sync_period_us,
            "mode": config.mode,
            "transmission.lead_mm": config.transmission.lead_mm,
        }
        control = config.control.model_dump().items()
        basis |= {f"control.{key}": value for key, value in control if value or key not in _GAINS_ADDED_LATER}
        fuzzy = config.section(FuzzyPdSettings)
        if fuzzy is not None and fuzzy.enabled:
            basis |= {f"fuzzy_pd.{key}": value for key, value in asdict(fuzzy).items()}
        if pulse is not None:
            basis["friction_compensation.rise_ms"] = pulse.rise_ms
            basis["friction_compensation.acceleration_allowed_mm_s2"] = pulse.acceleration_allowed_mm_s2
        return basis

    def objection(self, machine: MachineConfig, axis: str) -> str:
        """Return which pulse exceeds A_max (0 without the section), else ""."""
        pulse, amplitude_max_m_s = machine.axes[axis].section(FrictionCompensationSettings), 0.0
        if pulse is not None:
            amplitude_max_m_s = pulse.acceleration_allowed_mm_s2 * MM * pulse.rise_ms * 1e-3
        points: list[AmplitudePoint | TrailingPoint] = [*self.amplitudes, *self.trailing]
        for point in points:
            if abs(point.amplitude_m_s) > amplitude_max_m_s * _ROUNDING:
                return (
                    f"has an amplitude of {point.amplitude_m_s * 1e3:.6g} mm/s at "
                    f"{point.acceleration_m_s2 * 1e3:g} mm/s^2, beyond A_max {amplitude_max_m_s * 1e3:g} mm/s"
                )
        return ""
