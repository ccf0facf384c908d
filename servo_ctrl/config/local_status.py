"""The state of machine, drives, bus and learning on the local socket: `config.desk.DeskStatus` in JSON."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict

Stage = Literal[
    "booting",
    "starting",
    "ready",
    "running",
    "stopping",
    "quick_stopping",
    "disabling",
    "off",
    "standby",
]
"""Names of `axis.fault_policy.Stage` in lower case."""
LearningName = Literal["idle", "running", "pausing", "paused", "done", "aborted", "failed"]


class Message(BaseModel):
    """What the server sends: immutable, no unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)


class ReversalState(Message):
    """The indicators of one reversal."""

    cycle: int
    """Of the reversal itself."""
    direction: int
    """Of the motion after it: +1 or -1."""
    acceleration_m_s2: float | None
    contour_peak_m: float | None
    error_peak_m: float | None
    error_rms_m: float | None
    error_mean_m: float | None
    """J."""


class LearningState(Message):
    """The learning run that is going on, or the last one."""

    state: LearningName
    axis: str
    """"" before the first run."""
    reason: str
    stage: str
    """What the stroke is for."""
    strokes_done: int
    strokes_total: int
    progress: float
    """0 to 1."""
    remaining_s: float | None
    acceleration_m_s2: float | None
    best_m: float | None


class LearnedState(Message):
    """The learned functions of one axis; points over the reverse acceleration. See `learning.types`."""

    learner: str
    durations: tuple[tuple[float, float], ...]
    amplitudes: tuple[tuple[float, float], ...]
    trailing: tuple[tuple[float, float, float, float], ...]
    spread_m_s2: float | None
    before_m: float | None
    after_m: float | None
    strokes: int
    machine_time_s: float | None


class ScrewState(Message):
    """Screw compensation of one axis."""

    enabled: bool
    version: int
    learned_at: str
    points: tuple[tuple[float, float, float], ...]
    """Table position, error, lost motion there."""
    lost_motion_m: float | None
    before_m: float | None
    after_m: float | None


class AxisState(Message):
    """Compensation and monitoring of one axis."""

    name: str
    compensation_enabled: bool
    observer_enabled: bool
    learning_due: bool
    reversals: int
    last: ReversalState | None
    version: int
    """Of the learned functions in use, 0 = none."""
    learned_at: str
    learned: LearnedState | None
    screw: ScrewState


class DriveState(Message):
    """The drive of one axis; see `config.desk.DriveStatus`."""

    axis: str
    phase: str
    """Where its sequence is: "taking over", "waiting for rest", "switching on", "homing", "settling",
    "servo", "quick stopping", "disabling", "off" or "lost"."""
    state: str
    """CiA 402: "operation enabled", "fault" ..."""
    statusword: int
    error_code: int | None
    homed: bool
    position_m: float | None
    ready: bool
    limits_m: tuple[float, float]


class ProgramState(Message):
    """The program of the run; see `config.desk.ProgramStatus`."""

    name: str
    step: int
    label: str
    progress: float
    held: bool
    loaded: bool
    preparing: bool
    problem: str


class SettingsState(Message):
    """What can be changed while the machine runs."""

    required_m: float
    learner: str
    adaptation: bool


class Histogram(Message):
    """`counts` has one more than `edges_us`: below the first, between, above the last."""

    edges_us: tuple[float, ...]
    counts: tuple[int, ...]


class BusState(Message):
    """The bus and the cycle on it."""

    load: float
    """Share of the bit rate, 0 to 1, over the last second of SYNC time; stuff bits as many as may be."""
    bit_rate: int = 1_000_000
    """That `load` is a share of: CANopen's highest."""
    frames_per_s: float
    cycle_us: Histogram
    """Time from one cycle to the next."""
    missed_ticks: int
    missing_inputs: int


class NodeState(Message):
    """A node as it was heard."""

    name: str
    node_id: int
    nmt_state: str
    """"operational", "pre_operational", "stopped", "booting" or "unknown"."""
    heartbeat_age_s: float | None


class EmcyEntry(Message):
    """An emergency message."""

    time: str
    """ISO 8601."""
    node: str
    code: int
    error_register: int
    """1001h of the node."""
    text: str


class EventEntry(Message):
    """Something has happened."""

    cycle: int
    text: str


class Status(Message):
    """Everything that changes."""

    kind: Literal["status"] = "status"
    time: str
    """ISO 8601."""
    stage: Stage
    reason: str
    """Why the machine is stopping, in standby or off."""
    cycles: int
    missed_ticks: int
    learning: LearningState
    axes: tuple[AxisState, ...]
    drives: tuple[DriveState, ...]
    program: ProgramState
    settings: SettingsState
    bus: BusState
    nodes: tuple[NodeState, ...]
    emcy: tuple[EmcyEntry, ...]
    """The newest hundred, the newest last."""
    events: tuple[EventEntry, ...]
    """Likewise."""
    rows_missed: int = 0
    """By this client: it reads too slowly."""
