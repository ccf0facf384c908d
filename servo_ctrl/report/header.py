"""The checked types of recording.json, as far as a report needs it. docs/recordings.md is the reference."""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from servo_ctrl.recording.recorder import RecordingError

Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]


class _HeaderPart(BaseModel):
    """A part of recording.json: checks the keys that a report uses and ignores others."""

    model_config = ConfigDict(frozen=True, extra="ignore")


class RecordedStep(_HeaderPart):
    """One entry of `segments`."""

    label: str
    kind: str = ""
    steady_first_cycle: int = 0
    steady_last_cycle: int = -1


class RecordedNode(_HeaderPart):
    """A node on the bus."""

    name: str
    node_id: int
    eds: str


class RecordedLimits(_HeaderPart):
    """Limits of one axis."""

    velocity_m_s: Positive
    force_n: Positive
    following_error_m: Positive


class MonitoringSettings(_HeaderPart):
    """Settings of the evaluation of reversals."""

    required_m: Positive
    window_s: Positive


class CompensationInUse(_HeaderPart):
    """Compensation of one axis."""

    feedback: str
    fuzzy_pd: bool
    sampled_dual_loop: bool
    pulse: bool
    version: int
    learned_at: str
    observer: bool
    screw: bool
    screw_version: int
    screw_learned_at: str
    waveform: bool = False
    """False in recordings of earlier versions, which lack the key."""
    waveform_version: int = 0
    waveform_learned_at: str = ""


class RecordingHeader(_HeaderPart):
    """recording.json. Recordings of earlier versions lack nodes, limits and compensation."""

    format: Literal[1]
    software: str
    machine: str
    axes: Annotated[tuple[str, ...], Field(min_length=1)]
    period_s: Positive
    pacing: str
    started: str
    program: str | None = None
    segments: tuple[RecordedStep, ...]
    finished: bool
    completed: bool = False
    reason: str = ""
    events: tuple[str, ...] = ()
    event_cycles: tuple[int, ...] = ()
    first_sync: str = ""
    missed_ticks: int | None = None
    missing_inputs: int | None = None
    loss: str = ""
    nodes: tuple[RecordedNode, ...] = ()
    limits: dict[str, RecordedLimits] = {}
    monitoring: MonitoringSettings | None = None
    compensation: dict[str, CompensationInUse] = {}


def checked_header(directory: Path, content: Any) -> RecordingHeader:
    """Check the header of a recording. Raises RecordingError with the key."""
    try:
        return RecordingHeader.model_validate(content)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(map(str, first["loc"])) or "the whole of it"
        text = f"{directory}: recording.json cannot be reported on: {key}: {first['msg'].lower()}"
        raise RecordingError(text) from None
