"""The schema of a file with a learned result: date, machine, dependencies, result and checksum.

The result is a `LearnedContent`: pulse functions (`pulse_model`) or a screw (`screw_model`), in SI units. The
checksum covers the content, not the layout of the JSON.
"""

import hashlib
import json
from abc import abstractmethod
from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path
from typing import Annotated, Any, ClassVar, Generic, Literal, NoReturn, Self, TypeVar, get_args, get_origin

import numpy as np
from pydantic import Field, Strict, StringConstraints, ValidationError, field_validator

from servo_ctrl.config.file_format import format_problem
from servo_ctrl.config.load import as_config_error
from servo_ctrl.config.model import AxisName, MachineConfig  # pydantic resolves the annotations
from servo_ctrl.config.section import FileSection, NonNegative

FORMAT = 1
"""Format version of the files; raised when keys change their meaning."""
CONDITION_CHARACTERS_MAX = 1000
"""Bounds the characters of a condition; chosen."""

Text = Annotated[str, Strict(), StringConstraints(min_length=1, max_length=200)]
Scalar = (
    Annotated[bool, Strict()]
    | Annotated[int, Strict()]
    | Annotated[float, Strict()]
    | Annotated[str, Strict(), StringConstraints(max_length=CONDITION_CHARACTERS_MAX)]
)
Version = Annotated[int, Strict(), Field(ge=1, le=999_999)]
Basis = dict[str, float | str]


class LearnedContent(FileSection):
    """The `learned` part of a file: the fields of a `result`, with the points by name."""

    result: ClassVar[Callable[..., Any]]
    """The NamedTuple that learning and control law use."""
    learner: Text
    before_m: NonNegative
    after_m: NonNegative
    strokes: Annotated[int, Strict(), Field(ge=0)]
    machine_time_s: NonNegative

    @classmethod
    def values(cls, learned: Any) -> dict[str, Any]:
        """Convert a result to a mapping of plain numbers, without numpy types."""
        values = learned._asdict()
        for key, field in cls.model_fields.items():
            if get_origin(field.annotation) is list:
                names = get_args(field.annotation)[0].model_fields
                values[key] = [dict(zip(names, map(float, point), strict=True)) for point in values[key]]
            elif isinstance(values[key], np.generic):
                values[key] = values[key].item()
        return dict(values)

    def learned(self) -> Any:
        """Return the result, identical to the bit."""
        values = dict(self)
        for key, value in values.items():
            if isinstance(value, list):
                values[key] = tuple(tuple(vars(point).values()) for point in value)
        return self.result(**values)

    @staticmethod
    @abstractmethod
    def basis(machine: MachineConfig, axis: str) -> Basis:
        """Return the machine-file values that the result depends on, by their keys below [axis.NAME]."""

    @abstractmethod
    def objection(self, machine: MachineConfig, axis: str) -> str:
        """Return why the result must not be used for this axis, else ""."""


Content = TypeVar("Content", bound=LearnedContent)


class LearnedFile(FileSection, Generic[Content]):
    """One version of a learned result of an axis."""

    format: Literal[1]
    version: Version
    machine: Text
    axis: AxisName
    learned_at: Text
    """UTC, ISO 8601."""
    software: Text
    """Version of servo_ctrl that learned the result."""
    basis: Annotated[dict[Text, Scalar], Field(max_length=100)]
    """Machine-file values at the time of learning that the result depends on; see `LearnedContent.basis`."""
    conditions: Annotated[dict[Text, Scalar], Field(max_length=100)]
    """Further conditions of learning."""
    learned: Content
    sha256: Annotated[str, StringConstraints(pattern="^[0-9a-f]{64}$")]
    """Checksum of all other fields."""

    @field_validator("learned_at")
    @classmethod
    def _utc(cls, value: str) -> str:
        if datetime.fromisoformat(value).utcoffset() != timedelta(0):
            raise ValueError("must be a date and time in UTC, like 2026-11-21T10:00:00Z")
        return value

    @classmethod
    def sealed(cls, content: dict[str, Any]) -> Self:
        """Return the content with its checksum. Raises ValueError with the key of an invalid value."""
        draft = cls._checked({**content, "sha256": "0" * 64})
        return draft.model_copy(update={"sha256": _digest(draft.model_dump(mode="json", exclude={"sha256"}))})

    @classmethod
    def from_text(cls, text: str) -> Self:
        """Read a file from its text. Raises ValueError with the reason."""
        try:
            document = json.loads(text, parse_constant=_refuse_constant)
        except (ValueError, RecursionError) as error:
            raise ValueError(f"is damaged, no JSON: {error}") from None
        if not isinstance(document, dict):
            raise ValueError("is damaged: no JSON object")  # noqa: TRY004  # the file is wrong, not the caller
        version = document.get("format")
        if problem := format_problem(version, FORMAT) if version is not None else "has no format":
            raise ValueError(problem)
        content = {key: value for key, value in document.items() if key != "sha256"}
        if document.get("sha256") != _digest(content):
            raise ValueError("is damaged: its checksum (sha256) does not fit")
        return cls._checked(document)

    def to_text(self) -> str:
        """Return the text of the file."""
        return json.dumps(self.model_dump(mode="json"), indent=2, allow_nan=False) + "\n"

    def objection(self, machine: MachineConfig, axis: str) -> str:
        """Return why an intact file must not be used for this axis of this machine, else ""."""
        if self.machine != machine.machine.name:
            return f'was learned on machine "{self.machine}", this one is "{machine.machine.name}"'
        if self.axis != axis:
            return f'was learned on axis "{self.axis}", not "{axis}"'
        if stale := difference(self.basis, self.learned.basis(machine, axis)):
            return f"does not fit {machine.source} any more: {stale}"
        return self.learned.objection(machine, axis)

    @classmethod
    def _checked(cls, document: dict[str, Any]) -> Self:
        try:
            return cls.model_validate(document)
        except ValidationError as error:
            first = as_config_error(Path(), error)
            raise ValueError(f"{first.key}: {first.reason}") from None


def difference(recorded: dict[str, Any], current: dict[str, Any]) -> str:
    """Return a text about the first value that differs; "" when all are equal."""
    for key in dict.fromkeys([*current, *recorded]):
        if recorded.get(key) != current.get(key):
            return f"{key} was {recorded.get(key, 'not set')} then, it is {current.get(key, 'not set')} now"
    return ""


def _digest(content: dict[str, Any]) -> str:
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def _refuse_constant(constant: str) -> NoReturn:
    raise ValueError(f"{constant} is not a number")
