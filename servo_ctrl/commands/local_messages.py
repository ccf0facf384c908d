"""The messages between the controller and its page; docs/local_socket.md is the reference.

Units are SI, names lower case. The server sends `Hello` first and once, the status ten times a second and at
each change, `Reversal` after each evaluation, `LocalAnswer` to each `LocalRequest`. Because requests are not
trusted, pydantic checks them.
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
"""Format version; raised when a message changes its meaning."""

Role = Literal["view", "operate", "configure"]
Do = Literal[
    "command",
    "setting",
    "jog",
    "jog_step",
    "touch_off",
    "load_program",
    "run_line",
    "tuning_run",
    "heartbeat",
    "read_object",
    "write_object",
    "clear_counters",
    "take_control",
    "release_control",
]
MOST_PERIODS = 8
"""Evaluated periods each way of the longest motion of a tuning; chosen."""
RIGHTS: dict[Do, Right] = {
    "jog": Right.OPERATE,
    "jog_step": Right.OPERATE,
    "touch_off": Right.OPERATE,
    "load_program": Right.OPERATE,
    "run_line": Right.OPERATE,
    "tuning_run": Right.OPERATE,
    "heartbeat": Right.STOP,
    "read_object": Right.STOP,
    "write_object": Right.CONFIGURE,
    "clear_counters": Right.OPERATE,
    "take_control": Right.OPERATE,
    "release_control": Right.OPERATE,
}
"""The right that a request needs. Commands and settings declare their own (`Command`, `Setting`)."""
RequestValue = Annotated[
    Annotated[bool, Strict()]
    | Annotated[int, Strict()]
    | Annotated[float, Strict()]
    | Annotated[str, StringConstraints(strict=True, max_length=4096)],
    Field(union_mode="left_to_right"),
]
Short = Annotated[str, StringConstraints(strict=True, max_length=64)]


def right_for(do: Do, command: str = "", setting: str = "") -> Right:
    """Return the right that a request needs; OPERATE for an unknown command, which is refused later."""
    if do == "setting":
        return SETTINGS[setting].right if setting in SETTINGS else Right.CONFIGURE
    if do != "command":
        return RIGHTS[do]
    return COMMANDS[command].right if command in COMMANDS else Right.OPERATE


class AxisInfo(NamedTuple):
    """An axis of the machine file."""

    name: str
    travel_m: tuple[float, float]
    """Lowest and highest position set point, metres."""
    velocity_m_s: float
    """Velocity limit of every motion."""


class ChannelInfo(NamedTuple):
    """A column of the recorded rows."""

    name: str
    unit: str
    meaning: str


class NodeInfo(NamedTuple):
    """A node of the machine."""

    name: str
    """Its section in the machine file, such as "axis.x.drive"."""
    node_id: int
    eds: str
    """Path of its EDS."""


class Hello(NamedTuple):
    """The constant data of the server."""

    machine: str
    period_s: float
    axes: tuple[AxisInfo, ...]
    channels: tuple[ChannelInfo, ...]
    nodes: tuple[NodeInfo, ...]
    machine_file: str
    learned_dir: str
    record_dir: str | None
    """Directory of the recording of this run, None without one."""
    pid: int
    format: int = FORMAT
    lockstep: bool = False
    """No clock paces the cycles: each begins when all inputs of the one before are in."""
    machine_sha256: str = ""
    """SHA-256 of the machine file as the controller read it; "" from a controller that does not say it."""


class Reversal(NamedTuple):
    """An evaluated reversal of production."""

    axis: str
    report: ReversalReport
    period_s: float
    error_m: tuple[float, ...]
    """Error over the monitoring time, from the reversal on: command - actual, metres."""


class LocalAnswer(NamedTuple):
    """The answer to a request; the status shows the consequences."""

    id: int
    accepted: bool
    refusal: str = "none"
    """A name of `command.Refusal` in lower case, "malformed", or "unreachable" from the page itself."""
    reason: str = ""
    """Text for the user; empty when accepted."""
    value: float | str | None = None
    """Value of a read object: a number or text by its type in the EDS, else its bytes in hexadecimal."""


ServerMessage = Hello | MachineStatus | Reversal | LocalAnswer
KINDS: dict[str, Any] = {"hello": Hello, "status": MachineStatus, "reversal": Reversal, "answer": LocalAnswer}
"""Message types by the key `kind` of the JSON object."""


def message_json(kind: str, message: ServerMessage) -> bytes:
    """Encode a message of the server in JSON: ASCII, no spaces, no NaN."""
    return plain_json({"kind": kind, **to_plain(message)})


def plain_json(content: Any) -> bytes:
    """Encode JSON: ASCII, no spaces, no NaN."""
    return json.dumps(content, allow_nan=False, separators=(",", ":")).encode("ascii")


def server_message(payload: bytes) -> ServerMessage:
    """Decode a message in a frame of the server. Raises MessageError."""
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


class Requester(BaseModel):
    """The user of the page who sends a request."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    user: Short
    role: Role
    address: Short
    """Address of the browser."""


class ProgramText(BaseModel):
    """A program that shall replace the program of the run."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: Annotated[
        str, StringConstraints(strict=True, min_length=1, max_length=128, pattern=r"^[^/\\\x00]+$")
    ]
    """File name: .toml is a program of steps, anything else G-code."""
    text: Annotated[str, Strict()]
    first_line: Annotated[int, Strict(), Field(ge=1, lt=1 << 31)] = 1
    """Line of G-code to start from, with the modal state that the lines before it set."""


class TuningRun(BaseModel):
    """One motion of a tuning, with these values in the place of the machine file's."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    axis: Short
    control: dict[Short, RequestValue]
    """Keys of `[axis.NAME.control]`, checked as those of the machine file."""
    notch: dict[Short, RequestValue] | None = None
    """Keys of `[axis.NAME.notch]`; None = no notch."""
    force_n: Annotated[float, Field(ge=0.0)] = 0.0
    periods: Annotated[int, Strict(), Field(ge=0, le=MOST_PERIODS)] = 0
    trial: Annotated[bool, Strict()] = False
    """See `excitation.tuning_motion.TuningMotion`."""


class LocalRequest(BaseModel):
    """A request; `do` determines its fields."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    kind: Literal["request"] = "request"
    id: Annotated[int, Strict(), Field(ge=0, lt=1 << 53)]
    who: Requester
    do: Do
    axis: Short = ""
    """Axis of a command, "" = all axes; axis of a jog."""
    command: Short | None = None
    """A name of `command.Command` in lower case."""
    setting: Annotated[Short, AfterValidator(_known_setting)] | None = None
    value: RequestValue | None = None
    """Value of a setting; velocity of a jog, m/s; distance of a step, m; coordinate of a touch-off, m; a line
    of G-code; value of an object by its type in the EDS, bytes in hex."""
    program: ProgramText | None = None
    tuning: TuningRun | None = None
    node: Annotated[int, Strict(), Field(ge=1, le=127)] | None = None
    index: Annotated[int, Strict(), Field(ge=0, le=0xFFFF)] | None = None
    subindex: Annotated[int, Strict(), Field(ge=0, le=0xFF)] | None = None
