"""The messages between the control process and its page; docs/local_socket.md is the reference.

SI units throughout, names in lower case. `Hello` comes first and once, the status ten times a second and at
each change, `Reversal` as they are evaluated, `LocalAnswer` to each `LocalRequest`. Requests are not trusted:
pydantic checks them.
"""

import json
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, Strict, StringConstraints

from servo_ctrl.commands.command import COMMANDS, Right
from servo_ctrl.commands.local_codec import MessageError, from_plain, to_plain
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.commands.settings import SETTINGS
from servo_ctrl.learning.types import ReversalReport  # the codec reads the types

FORMAT = 1
"""Raised when a message changes its meaning."""

Role = Literal["view", "operate", "configure"]
Do = Literal[
    "command",
    "setting",
    "jog",
    "jog_step",
    "touch_off",
    "load_program",
    "run_line",
    "read_object",
    "write_object",
    "clear_counters",
    "take_control",
    "release_control",
]
RIGHTS: dict[Do, Right] = {
    "jog": Right.OPERATE,
    "jog_step": Right.OPERATE,
    "touch_off": Right.OPERATE,
    "load_program": Right.OPERATE,
    "run_line": Right.OPERATE,
    "read_object": Right.STOP,
    "write_object": Right.CONFIGURE,
    "clear_counters": Right.OPERATE,
    "take_control": Right.OPERATE,
    "release_control": Right.OPERATE,
}
"""The right that a request needs. A command has its own, see `command.Command`, and so has a setting."""
RequestValue = Annotated[
    Annotated[bool, Strict()]
    | Annotated[int, Strict()]
    | Annotated[float, Strict()]
    | Annotated[str, StringConstraints(strict=True, max_length=4096)],
    Field(union_mode="left_to_right"),
]
Short = Annotated[str, StringConstraints(strict=True, max_length=64)]


def right_for(do: Do, command: str = "", setting: str = "") -> Right:
    """The right that a request needs; an unknown command needs operate, and the controller refuses it."""
    if do == "setting":
        return SETTINGS[setting].right if setting in SETTINGS else Right.CONFIGURE
    if do != "command":
        return RIGHTS[do]
    return COMMANDS[command].right if command in COMMANDS else Right.OPERATE


class AxisInfo(NamedTuple):
    """An axis of the machine file."""

    name: str
    travel_m: tuple[float, float]
    """Lowest and highest position command."""
    velocity_m_s: float
    """Bound of every motion."""


class ChannelInfo(NamedTuple):
    """A column of the rows."""

    name: str
    unit: str
    meaning: str


class NodeInfo(NamedTuple):
    """A node of the machine."""

    name: str
    """Its section in the machine file, as "axis.x.drive"."""
    node_id: int
    eds: str
    """Its data sheet, a file."""


class Hello(NamedTuple):
    """Who the server is: what does not change while it runs."""

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
    format: int = FORMAT


class Reversal(NamedTuple):
    """A reversal of production was evaluated."""

    axis: str
    report: ReversalReport
    period_s: float
    error_m: tuple[float, ...]
    """Over the monitoring time, from the reversal on; positive = lagging."""


class LocalAnswer(NamedTuple):
    """The answer to a request; what follows from it shows in the status."""

    id: int
    accepted: bool
    refusal: str = "none"
    """A name of `command.Refusal` in lower case, "malformed", or "unreachable" from the page itself."""
    reason: str = ""
    """In words; empty when accepted."""
    value: float | str | None = None
    """Of an object that was read: a number or text where its EDS says so, else its bytes in hexadecimal."""


ServerMessage = Hello | MachineStatus | Reversal | LocalAnswer
KINDS: dict[str, Any] = {"hello": Hello, "status": MachineStatus, "reversal": Reversal, "answer": LocalAnswer}
"""By the key `kind` of the JSON object."""


def message_json(kind: str, message: ServerMessage) -> bytes:
    """A message of the server as it travels: ASCII, no spaces, no NaN."""
    return plain_json({"kind": kind, **to_plain(message)})


def plain_json(content: Any) -> bytes:
    """JSON as it travels here."""
    return json.dumps(content, allow_nan=False, separators=(",", ":")).encode("ascii")


def server_message(payload: bytes) -> ServerMessage:
    """The message in a frame of the server. Raises MessageError."""
    try:
        content = json.loads(payload)
        message: ServerMessage = from_plain(KINDS[content.pop("kind")], content)
    except (ValueError, KeyError, AttributeError, RecursionError) as error:
        raise MessageError(f"no message of the controller: {error!r:.80}") from None
    if isinstance(message, Hello) and message.format != FORMAT:
        raise MessageError(f"format: {message.format}, only {FORMAT} is understood")
    return message


def _known_setting(name: str) -> str:
    if name not in SETTINGS:
        raise ValueError(f"there is no setting, only {', '.join(SETTINGS)}")
    return name


class Who(BaseModel):
    """The user of the page who sends a request."""

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
    first_line: Annotated[int, Strict(), Field(ge=1, lt=1 << 31)] = 1
    """Of G-code: run from there, with what the lines before it have set."""


class LocalRequest(BaseModel):
    """A request; which fields it has depends on `do`."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    kind: Literal["request"] = "request"
    id: Annotated[int, Strict(), Field(ge=0, lt=1 << 53)]
    who: Who
    do: Do
    axis: Short = ""
    """Of a command, "" = all axes; of a jog."""
    command: Short | None = None
    """A name of `command.Command` in lower case."""
    setting: Annotated[Short, AfterValidator(_known_setting)] | None = None
    value: RequestValue | None = None
    """Of a setting; velocity of a jog, m/s; way of a step, m; what the place of a touch-off is called, m;
    a line of G-code; of an object to be written, as its EDS has it, bytes in hex."""
    program: ProgramText | None = None
    node: Annotated[int, Strict(), Field(ge=1, le=127)] | None = None
    index: Annotated[int, Strict(), Field(ge=0, le=0xFFFF)] | None = None
    subindex: Annotated[int, Strict(), Field(ge=0, le=0xFF)] | None = None
