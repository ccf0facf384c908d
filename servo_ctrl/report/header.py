"""recording.json as types: what a report needs of it, checked. docs/recordings.md is the reference."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from servo_ctrl.telemetry.recorder import RecordingError

if TYPE_CHECKING:
    from pathlib import Path

Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]


class _Part(BaseModel):
    """Keys that a report does not know are none of its business; those it knows are checked."""

    model_config = ConfigDict(frozen=True, extra="ignore")


class Step(_Part):
    """One entry of `segments`."""

    label: str
    kind: str = ""
    steady_first_cycle: int = 0
    steady_last_cycle: int = -1


class Node(_Part):
    """A node on the bus."""

    name: str
    node_id: int
    eds: str


class Limits(_Part):
    """Of one axis."""

    velocity_m_s: Positive
    force_n: Positive
    following_error_m: Positive


class Monitoring(_Part):
    """How reversals were judged."""

    required_m: Positive
    window_s: Positive


class InUse(_Part):
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


class Header(_Part):
    """recording.json. Recordings of earlier versions have neither nodes nor limits nor compensation."""

    format: Literal[1]
    software: str
    machine: str
    axes: Annotated[tuple[str, ...], Field(min_length=1)]
    period_s: Positive
    pacing: str
    started: str
    program: str | None = None
    segments: tuple[Step, ...]
    finished: bool
    completed: bool = False
    reason: str = ""
    events: tuple[str, ...] = ()
    missed_ticks: int | None = None
    missing_inputs: int | None = None
    loss: str = ""
    nodes: tuple[Node, ...] = ()
    limits: dict[str, Limits] = {}
    monitoring: Monitoring | None = None
    compensation: dict[str, InUse] = {}


def checked_header(directory: Path, content: Any) -> Header:
    """The header of a recording; raises RecordingError naming the key."""
    try:
        return Header.model_validate(content)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(map(str, first["loc"])) or "the whole of it"
        text = f"{directory}: recording.json cannot be reported on: {key}: {first['msg'].lower()}"
        raise RecordingError(text) from None
