"""What the control process and its page tell each other; docs/local_socket.md is the reference.

SI units throughout, names in lower case. A quantity that is not known (yet) is None. `Hello` comes first and
once, `Status` ten times a second and at each change, `Reversal` as they are evaluated, `Answer` to each
`Request`.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, Strict, StringConstraints

from servo_ctrl.config.local_status import Message, ReversalState, Status

FORMAT: Literal[1] = 1
"""Raised when a message changes its meaning."""

Role = Literal["view", "operate", "configure"]
Do = Literal[
    "command",
    "setting",
    "jog",
    "load_program",
    "read_object",
    "write_object",
    "clear_counters",
    "take_control",
    "release_control",
]
RequestValue = Annotated[
    Annotated[bool, Strict()]
    | Annotated[int, Strict()]
    | Annotated[float, Strict()]
    | Annotated[str, StringConstraints(strict=True, max_length=4096)],
    Field(union_mode="left_to_right"),
]
Short = Annotated[str, StringConstraints(strict=True, max_length=64)]


class AxisInfo(Message):
    """An axis of the machine file."""

    name: str
    travel_m: tuple[float, float]
    """Lowest and highest position command."""
    velocity_m_s: float
    """Bound of every motion."""


class ChannelInfo(Message):
    """A column of the rows."""

    name: str
    unit: str
    meaning: str


class NodeInfo(Message):
    """A node of the machine."""

    name: str
    """Its section in the machine file, as "axis.x.drive"."""
    node_id: int
    eds: str
    """Its data sheet, a file."""


class Hello(Message):
    """Who the server is: what does not change while it runs."""

    kind: Literal["hello"] = "hello"
    format: Literal[1] = FORMAT
    machine: str
    period_s: float
    axes: tuple[AxisInfo, ...]
    channels: tuple[ChannelInfo, ...]
    nodes: tuple[NodeInfo, ...]
    machine_file: str
    learned_dir: str
    record_dir: str | None
    """Where this run is being recorded."""
    pid: int


class Reversal(Message):
    """A reversal of production was evaluated."""

    kind: Literal["reversal"] = "reversal"
    axis: str
    report: ReversalState
    period_s: float
    error_m: tuple[float | None, ...]
    """Over the monitoring time, from the reversal on; positive = lagging."""


class Answer(Message):
    """The answer to a request; what follows from it shows in the status."""

    kind: Literal["answer"] = "answer"
    id: int
    accepted: bool
    refusal: str = "none"
    """A name of `config.desk.Refusal` in lower case, "malformed", or "unreachable" from the page itself."""
    reason: str = ""
    """In words; empty when accepted."""
    value: int | float | str | None = None
    """Of an object that was read: a number or text where its EDS says so, else its bytes in hexadecimal."""


class Who(BaseModel):
    """Who asks, as the page knows them."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    user: Short
    role: Role
    address: Short
    """Of the browser."""


class ProgramText(BaseModel):
    """A program that is to take the place of the run's."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: Annotated[
        str, StringConstraints(strict=True, min_length=1, max_length=128, pattern=r"^[^/\\\x00]+$")
    ]
    """Of its file: .toml is a program of steps, anything else G-code."""
    text: Annotated[str, Strict()]


class Request(BaseModel):
    """What somebody wants done. Which fields it has depends on `do`."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    kind: Literal["request"] = "request"
    id: Annotated[int, Strict(), Field(ge=0, lt=1 << 53)]
    who: Who
    do: Do
    axis: Short = ""
    """Of a command, "" = all axes; of a jog."""
    command: Short | None = None
    """A name of `config.desk.Command` in lower case."""
    setting: Literal["required_m", "learner", "adaptation"] | None = None
    value: RequestValue | None = None
    """Of a setting; velocity of a jog, m/s; of an object to be written, as its EDS has it, bytes in hex."""
    program: ProgramText | None = None
    node: Annotated[int, Strict(), Field(ge=1, le=127)] | None = None
    index: Annotated[int, Strict(), Field(ge=0, le=0xFFFF)] | None = None
    subindex: Annotated[int, Strict(), Field(ge=0, le=0xFF)] | None = None


ServerMessage = Annotated[Hello | Status | Reversal | Answer, Field(discriminator="kind")]
