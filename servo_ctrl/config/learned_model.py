"""A file of learned functions as types: what was learned, when, on what; and whether it still holds.

SI units, as inside. The checksum is over the content, not over how the JSON is laid out.
"""

from __future__ import annotations

import hashlib
import json
from datetime import datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NoReturn

from pydantic import Field, Strict, StringConstraints, ValidationError, field_validator

from servo_ctrl.config.freeze import axis_params
from servo_ctrl.config.load import as_config_error
from servo_ctrl.config.model import AxisName  # noqa: TC001  # pydantic resolves the annotation
from servo_ctrl.config.section import NonNegative, Number, Positive, Section
from servo_ctrl.learning.types import Learned

if TYPE_CHECKING:
    from collections.abc import Iterable

    from servo_ctrl.config.model import MachineConfig

FORMAT = 1
"""Of the result files; raised when their keys change their meaning."""
LONGEST_PULSE_S = 60.0
POINTS = 2000
LONGEST_CONDITION = 1000
"""Characters."""
_ROUNDING = 1.0 + 1e-9
"""A_max is computed in more than one place: the last bit may differ."""

Text = Annotated[str, Strict(), StringConstraints(min_length=1, max_length=200)]
Scalar = (
    Annotated[bool, Strict()]
    | Annotated[int, Strict()]
    | Annotated[float, Strict()]
    | Annotated[str, Strict(), StringConstraints(max_length=LONGEST_CONDITION)]
)
PulseTime = Annotated[float, Strict(), Field(ge=0.0, le=LONGEST_PULSE_S)]
Version = Annotated[int, Strict(), Field(ge=1, le=999_999)]


class DurationPoint(Section):
    """One point of T*(a)."""

    acceleration_m_s2: Positive
    duration_s: Annotated[float, Strict(), Field(gt=0.0, le=LONGEST_PULSE_S)]


class AmplitudePoint(Section):
    """One point of A*(a); a pulse against the new direction would only make the error larger."""

    acceleration_m_s2: Positive
    amplitude_m_s: Positive


class TrailingPoint(Section):
    """The second trapezoid at one acceleration."""

    acceleration_m_s2: Positive
    start_s: PulseTime
    duration_s: PulseTime
    amplitude_m_s: Number


class LearnedFunctions(Section):
    """`learning.types.Learned` with its points by name."""

    learner: Text
    before_m: NonNegative
    after_m: NonNegative
    strokes: Annotated[int, Strict(), Field(ge=0)]
    machine_time_s: NonNegative
    durations: Annotated[list[DurationPoint], Field(min_length=1, max_length=POINTS)]
    amplitudes: Annotated[list[AmplitudePoint], Field(min_length=1, max_length=POINTS)]
    spread_m_s2: NonNegative
    trailing: Annotated[list[TrailingPoint], Field(max_length=POINTS)]

    @field_validator("durations", "amplitudes", "trailing")
    @classmethod
    def _rising(cls, value: list[Any]) -> list[Any]:
        accelerations = [point.acceleration_m_s2 for point in value]
        if sorted(set(accelerations)) != accelerations:
            raise ValueError("the accelerations must rise")
        return value

    def learned(self) -> Learned:
        """As learning knows it, the same bits."""
        return Learned(
            learner=self.learner,
            durations=tuple((p.acceleration_m_s2, p.duration_s) for p in self.durations),
            amplitudes=tuple((p.acceleration_m_s2, p.amplitude_m_s) for p in self.amplitudes),
            spread_m_s2=self.spread_m_s2,
            trailing=tuple(
                (p.acceleration_m_s2, p.start_s, p.duration_s, p.amplitude_m_s) for p in self.trailing
            ),
            before_m=self.before_m,
            after_m=self.after_m,
            strokes=self.strokes,
            machine_time_s=self.machine_time_s,
        )


class ResultFile(Section):
    """One version of what an axis has learned."""

    format: Literal[1]
    version: Version
    machine: Text
    axis: AxisName
    learned_at: Text
    """UTC, ISO 8601."""
    software: Text
    """Version of servo_ctrl that learned it."""
    basis: Annotated[dict[Text, Scalar], Field(max_length=100)]
    """What the result depends on, as it stood in the machine file; see `basis_of`."""
    conditions: Annotated[dict[Text, Scalar], Field(max_length=100)]
    """Whatever else is worth knowing."""
    learned: LearnedFunctions
    sha256: Annotated[str, StringConstraints(pattern="^[0-9a-f]{64}$")]
    """Of all the rest."""

    @field_validator("learned_at")
    @classmethod
    def _utc(cls, value: str) -> str:
        if datetime.fromisoformat(value).utcoffset() != timedelta(0):
            raise ValueError("must be a date and time in UTC, like 2026-11-21T10:00:00Z")
        return value


def basis_of(machine: MachineConfig, axis: str) -> dict[str, float | str]:
    """The values of the machine file that a learned pulse depends on, by their keys below [axis.NAME]."""
    config, pulse = machine.axes[axis], machine.axes[axis].friction_compensation
    basis: dict[str, float | str] = {
        "sync_period_us": machine.bus.sync_period_us,
        "mode": config.mode,
        "transmission.lead_mm": config.transmission.lead_mm,
    }
    basis |= {f"control.{key}": value for key, value in config.control.model_dump().items()}
    if pulse is not None:
        basis["friction_compensation.rise_ms"] = pulse.rise_ms
        basis["friction_compensation.acceleration_allowed_mm_s2"] = pulse.acceleration_allowed_mm_s2
    return basis


def difference(then: dict[str, Any], now: dict[str, Any]) -> str:
    """The first value that is not as it was, in words; "" when all are the same."""
    for key in dict.fromkeys([*now, *then]):
        if then.get(key) != now.get(key):
            return f"{key} was {then.get(key, 'not set')} then, it is {now.get(key, 'not set')} now"
    return ""


def objection(result: ResultFile, machine: MachineConfig, axis: str) -> str:
    """What speaks against using a whole file for this axis of this machine; "" when nothing does."""
    if result.machine != machine.machine.name:
        return f'was learned on machine "{result.machine}", this one is "{machine.machine.name}"'
    if result.axis != axis:
        return f'was learned on axis "{result.axis}", not "{axis}"'
    if stale := difference(result.basis, basis_of(machine, axis)):
        return f"does not fit {machine.source} any more: {stale}"
    amplitude_max_m_s = axis_params(machine, axis).pulse.amplitude_max_m_s
    points: list[AmplitudePoint | TrailingPoint] = [*result.learned.amplitudes, *result.learned.trailing]
    for point in points:
        if abs(point.amplitude_m_s) > amplitude_max_m_s * _ROUNDING:
            return (
                f"has an amplitude of {point.amplitude_m_s * 1e3:.6g} mm/s "
                f"at {point.acceleration_m_s2 * 1e3:g} mm/s^2, beyond A_max {amplitude_max_m_s * 1e3:g} mm/s"
            )
    return ""


def functions_of(learned: Learned) -> dict[str, Any]:
    """The `learned` section of a file, in plain numbers."""
    return {
        **learned._asdict(),
        "before_m": float(learned.before_m),
        "after_m": float(learned.after_m),
        "strokes": int(learned.strokes),
        "machine_time_s": float(learned.machine_time_s),
        "spread_m_s2": float(learned.spread_m_s2),
        "durations": _rows(DurationPoint, learned.durations),
        "amplitudes": _rows(AmplitudePoint, learned.amplitudes),
        "trailing": _rows(TrailingPoint, learned.trailing),
    }


def _rows(kind: type[Section], points: Iterable[Iterable[float]]) -> list[dict[str, float]]:
    return [dict(zip(kind.model_fields, map(float, point), strict=True)) for point in points]


def sealed(content: dict[str, Any]) -> ResultFile:
    """The content with its checksum; raises ValueError, naming the key, where a value is out of range."""
    draft = _checked({**content, "sha256": "0" * 64})
    return draft.model_copy(update={"sha256": _digest(draft.model_dump(mode="json", exclude={"sha256"}))})


def to_text(result: ResultFile) -> str:
    """The file's text."""
    return json.dumps(result.model_dump(mode="json"), indent=2, allow_nan=False) + "\n"


def from_text(text: str) -> ResultFile:
    """The file from its text; raises ValueError, which says what is wrong with it."""
    try:
        document = json.loads(text, parse_constant=_refuse)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"is damaged, no JSON: {error}") from None
    if not isinstance(document, dict):
        raise ValueError("is damaged: no JSON object")  # noqa: TRY004  # the file is wrong, not the caller
    if document.get("format") != FORMAT:
        raise ValueError(f"has format {document.get('format')}, this servo-ctrl knows {FORMAT}")
    content = {key: value for key, value in document.items() if key != "sha256"}
    if document.get("sha256") != _digest(content):
        raise ValueError("is damaged: its checksum (sha256) does not fit")
    return _checked(document)


def _checked(document: dict[str, Any]) -> ResultFile:
    try:
        return ResultFile.model_validate(document)
    except ValidationError as error:
        first = as_config_error(Path(), error)
        raise ValueError(f"{first.key}: {first.reason}") from None


def _digest(content: dict[str, Any]) -> str:
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def _refuse(constant: str) -> NoReturn:
    raise ValueError(f"{constant} is no number")
