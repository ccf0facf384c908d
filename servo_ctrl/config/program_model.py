"""The schema of a program file: a list of steps, in millimetres and mm/min as in the file."""

from pathlib import Path  # pydantic resolves the annotation when the class is made
from typing import Annotated, Literal, Self

from pydantic import Field, Strict, StringConstraints, field_validator, model_validator

from servo_ctrl.config.model import AxisName  # pydantic resolves the annotation
from servo_ctrl.config.section import FileSection, Number, Positive

KIND = Field(description="Kind of the step.")
Label = Annotated[
    str,
    StringConstraints(min_length=1, max_length=80),
    Field(description="Its name in messages, recordings and tables."),
]
Repeats = Annotated[int, Strict(), Field(ge=1, le=1_000_000)]
LONGEST_STEP_S = 86_400.0
"""Bounds one step, seconds; chosen: a day."""


class MoveStep(FileSection):
    """A straight move of one or more axes, from rest to rest."""

    kind: Annotated[Literal["move"], KIND]
    label: Label = "move"
    to_mm: Annotated[dict[AxisName, Number], Field(min_length=1)]
    """Absolute target of each named axis, millimetres; the others hold."""
    feed_mm_min: Positive
    """Speed along the path, mm/min."""
    profile: Literal["s_curve", "trapezoidal"] = "s_curve"
    """Five-phase S curve, or trapezoidal velocity."""
    acceleration_mm_s2: Positive | None = None
    """Acceleration along the path, mm/s^2; without it as high as the axes allow."""


class CircleStep(FileSection):
    """A circle that starts at the present position, which is centre + (radius, 0)."""

    kind: Annotated[Literal["circle"], KIND]
    label: Label = "circle"
    axes: Annotated[list[AxisName], Field(min_length=2, max_length=2, default_factory=lambda: ["x", "y"])]
    """Axes of the plane, by default x and y; the first axis starts at +radius."""
    radius_mm: Positive
    """Radius R, millimetres."""
    feed_mm_min: Positive
    """Speed along the circle F, mm/min; the reverse acceleration is F^2 / R."""
    turns: Positive = 1.0
    """Number of turns including ramps; need not be an integer."""
    direction: Literal["ccw", "cw"] = "ccw"
    """Counterclockwise or clockwise."""
    ramp_s: Positive | None = None
    """Time of the speed ramp at either end, seconds; without it, an eighth of a turn."""

    @field_validator("axes")
    @classmethod
    def _two_axes(cls, value: list[str]) -> list[str]:
        if value[0] == value[1]:
            raise ValueError(f'a circle needs two axes, not "{value[0]}" twice')
        return value


class SineStep(FileSection):
    """A sine of one axis about its present position."""

    kind: Annotated[Literal["sine"], KIND]
    label: Label = "sine"
    axis: AxisName
    """The axis that moves."""
    amplitude_mm: Positive
    """Amplitude A, millimetres: from -A to +A about the start."""
    frequency_hz: Positive | None = None
    """Cycles per second, Hz; either this or reverse_acceleration_mm_s2."""
    reverse_acceleration_mm_s2: Positive | None = None
    """Acceleration at the reversals, mm/s^2: amplitude (2 pi f)^2."""
    cycles: Positive = 1.0
    """Number of cycles including ramps; need not be an integer."""
    ramp_s: Positive | None = None
    """Time of the speed ramp at either end, seconds; without it, an eighth of a cycle."""

    @model_validator(mode="after")
    def _one_speed(self) -> Self:
        if (self.frequency_hz is None) == (self.reverse_acceleration_mm_s2 is None):
            raise ValueError("frequency_hz: give either it or reverse_acceleration_mm_s2")
        return self


class SShapeStep(FileSection):
    """There and back on one axis with trapezoidal velocity, reversing at constant acceleration."""

    kind: Annotated[Literal["s_shape"], KIND]
    label: Label = "s_shape"
    axis: AxisName
    """The axis that moves."""
    distance_mm: Number
    """Signed distance, millimetres."""
    velocity_mm_s: Positive
    """Speed of the cruise, mm/s."""
    acceleration_mm_s2: Positive
    """Acceleration of all ramps and so of the reversals, mm/s^2."""
    repeats: Repeats = 1
    """Number of moves there and back."""

    @field_validator("distance_mm")
    @classmethod
    def _distance_is_not_zero(cls, value: float) -> float:
        if value == 0.0:
            raise ValueError("must not be 0")
        return value


class DwellStep(FileSection):
    """A pause of all axes at standstill."""

    kind: Annotated[Literal["dwell"], KIND]
    label: Label = "dwell"
    seconds: Annotated[float, Strict(), Field(gt=0.0, le=LONGEST_STEP_S)]
    """Duration, seconds."""


class SamplesStep(FileSection):
    """Recorded set points at the SYNC period, from a file (npz, csv, parquet) of named columns."""

    kind: Annotated[Literal["samples"], KIND]
    label: Label = "samples"
    file: Path | None = None
    """File of the samples, relative to this file; either this or input."""
    input: Annotated[str, StringConstraints(min_length=1)] | None = None
    """Name of an input, for which the command line gives the file."""
    time: Annotated[str, StringConstraints(min_length=1)] = "time_s"
    """Column of the time, seconds; its steps must be the SYNC period."""
    position: Annotated[dict[AxisName, str], Field(min_length=1)]
    """Column of each axis's position, metres; other axes hold."""
    force_offset: Annotated[dict[AxisName, str], Field(default_factory=dict)]
    """Column of each axis's force offset (60B2h)."""
    force_offset_gain: Annotated[dict[AxisName, Number], Field(default_factory=dict)]
    """Newtons per unit of that column; default 1."""

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if (self.file is None) == (self.input is None):
            raise ValueError("file: give either it or input")
        for axis in self.force_offset_gain:
            if axis not in self.force_offset:
                raise ValueError(f"force_offset_gain.{axis}: there is no force_offset.{axis}")
        return self


StepConfig = Annotated[
    MoveStep | CircleStep | SineStep | SShapeStep | DwellStep | SamplesStep, Field(discriminator="kind")
]


class ProgramConfig(FileSection):
    """A whole program file; `source` is its path."""

    source: Path
    steps: Annotated[list[StepConfig], Field(alias="step", min_length=1)]


def step_key(index: int, label: str) -> str:
    """Return the name of a step in messages: its number, from 1, and its label."""
    return f'step[{index + 1}] "{label}"'


def axes_of(step: StepConfig) -> list[tuple[str, str]]:
    """Return the axes that a step names, each with its key."""
    match step:
        case MoveStep():
            return [("to_mm", axis) for axis in step.to_mm]
        case CircleStep():
            return [("axes", axis) for axis in step.axes]
        case SineStep() | SShapeStep():
            return [("axis", step.axis)]
        case SamplesStep():
            return [("position", axis) for axis in step.position] + [
                ("force_offset", axis) for axis in step.force_offset
            ]
        case DwellStep():
            return []
