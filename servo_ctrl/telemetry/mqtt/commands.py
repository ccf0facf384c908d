"""Executes commands received by MQTT: reads strictly, executes at most once, always answers.

No message is trusted. A malformed message is refused as "malformed", a retained one as "stale"; the command
handler answers all others. Because QoS 1 may deliver a message twice, an id answered lately gets the same
answer again without another execution.
"""

import json
from collections import OrderedDict
from collections.abc import Callable
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, Strict, StringConstraints, TypeAdapter, ValidationError

from kernels.validation_messages import plain_message
from servo_ctrl.commands.command import COMMANDS, Command, CommandRequest, CommandResult, Refusal, Right
from servo_ctrl.commands.handler import CommandHandler
from servo_ctrl.commands.settings import SETTINGS, Setting

LENGTH_LIMIT = 4096
"""Bounds the bytes of a message; chosen, more than ten times the longest command."""
IDS_KEPT = 256
"""Number of answers kept to recognise repeated messages; chosen."""
QUOTED_CHARACTERS_MAX = 40
"""Bounds the characters of a message that an answer quotes; chosen."""

SETTING_OF = {setting.key: setting for setting in SETTINGS.values()}
"""Settings by their keys in messages."""
_RequestId = Annotated[str, StringConstraints(strict=True, min_length=1, max_length=64)]
_Name = Annotated[str, StringConstraints(strict=True, max_length=64)]
_NUMBER = TypeAdapter[float](Annotated[float, Strict(), Field(allow_inf_nan=False)])
_SWITCH = TypeAdapter[bool](Annotated[bool, Strict()])


class MqttAnswer(NamedTuple):
    """The answer to the sender of a message."""

    request_id: str | None
    """None if the message has no readable id."""
    refusal: str
    """"none" when accepted; a name of `Refusal` in lower case, "malformed", "stale" or "wrong_topic"."""
    reason: str


class _Message(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")
    id: _RequestId


class _CommandMessage(_Message):
    command: _Name
    axis: _Name = ""


class _SettingMessage(_Message):
    setting: _Name
    value: Any


class _MalformedError(Exception):
    """The message is malformed; the text gives the reason."""


class MqttCommands:
    """Answers the messages of one topic; `handler` executes their requests.

    `right`: the right that the topic gives; None: every right. `note` logs an event for each request.
    """

    def __init__(
        self, handler: CommandHandler, right: Right | None = None, note: Callable[[str], None] | None = None
    ) -> None:
        self._handler, self._right, self._note = handler, right, note
        self._answered: OrderedDict[str, tuple[_Message, MqttAnswer]] = OrderedDict()

    def answer(self, payload: bytes, *, retained: bool) -> MqttAnswer:
        """Execute the request in a message, or refuse it with a reason."""
        document: Any = None
        try:
            document = _document(payload)
            if retained:
                return MqttAnswer(_id_of(document), "stale", "a command must not be retained by the broker")
            message = _message(document)
        except _MalformedError as error:
            return MqttAnswer(_id_of(document), "malformed", str(error))
        if message.id in self._answered:
            earlier, answer = self._answered[message.id]
            if message != earlier:
                return MqttAnswer(message.id, "malformed", "id: was used for another message")
            return answer
        answer = MqttAnswer(message.id, *self._execute(message))
        if self._note is not None:
            self._note(self._in_words(message, answer))
        self._answered[message.id] = message, answer
        if len(self._answered) > IDS_KEPT:
            self._answered.popitem(last=False)
        return answer

    def _execute(self, message: _CommandMessage | _SettingMessage) -> tuple[str, str]:
        if isinstance(message, _CommandMessage):
            command = COMMANDS.get(message.command)
            if command is None:
                return _refused(Refusal.UNKNOWN, f"command: no {_shown(message.command)}", COMMANDS)
            request = CommandRequest(command, message.axis)
            return self._wrong_topic(command) or _answer_of(self._handler.execute(request))
        setting = SETTING_OF.get(message.setting)
        if setting is None:
            return _refused(Refusal.UNKNOWN, f"setting: no {_shown(message.setting)}", SETTING_OF)
        try:
            value = _value(setting, message.value)
        except ValidationError as error:
            return _refused(Refusal.OUT_OF_RANGE, _reason(error, "value"))
        return self._wrong_topic(setting) or _answer_of(self._handler.change(setting.name, value))

    def _wrong_topic(self, request: Command | Setting) -> tuple[str, str] | None:
        if self._right is None or self._right.permits(request.right):
            return None
        what = request.name.lower() if isinstance(request, Command) else f"the setting {request.key}"
        return "wrong_topic", f"{what} is for command/{request.right}"

    def _in_words(self, message: _CommandMessage | _SettingMessage, answer: MqttAnswer) -> str:
        """Return an event text without any text of the sender."""
        topic = "command" if self._right is None else f"command/{self._right}"
        name = message.command if isinstance(message, _CommandMessage) else message.setting
        what = name if name in COMMANDS or name in SETTING_OF else "an unknown request"
        return f"MQTT {topic}: {what}" + ("" if answer.refusal == "none" else f", refused: {answer.refusal}")


def _document(payload: bytes) -> Any:
    """Return the JSON value in a payload."""
    if len(payload) > LENGTH_LIMIT:
        raise _MalformedError(f"{len(payload)} bytes, at most {LENGTH_LIMIT} are read")
    try:
        return json.loads(payload.decode("utf-8"), object_pairs_hook=_without_duplicates)
    except UnicodeDecodeError as error:
        raise _MalformedError(f"not UTF-8 at byte {error.start}") from None
    except RecursionError:
        raise _MalformedError("not JSON: nested too deeply") from None
    except ValueError as error:
        raise _MalformedError(f"not JSON: {error}") from None


def _without_duplicates(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return the object; refuse repeated keys, because it is unknown which value the sender means."""
    content = dict(pairs)
    if len(content) < len(pairs):
        raise _MalformedError("a key appears twice")
    return content


def _message(document: Any) -> _CommandMessage | _SettingMessage:
    if not isinstance(document, dict):
        raise _MalformedError("not a JSON object")
    kind = _SettingMessage if "setting" in document else _CommandMessage
    try:
        return kind.model_validate(document)
    except ValidationError as error:
        raise _MalformedError(_reason(error)) from None


def _id_of(document: Any) -> str | None:
    """Return the id even of a malformed message, so that its sender recognises the answer."""
    request_id = document.get("id") if isinstance(document, dict) else None
    return request_id if isinstance(request_id, str) and 1 <= len(request_id) <= 64 else None


def _value(setting: Setting, given: Any) -> float | str | bool:
    """Return the value of a setting in SI units. Raises ValidationError."""
    if setting.kind is float:
        return _NUMBER.validate_python(given) / setting.factor
    if setting.kind is bool:
        return _SWITCH.validate_python(given)
    names: Any = Literal[setting.entry.names]
    name: str = TypeAdapter(names).validate_python(given)
    return name


def _answer_of(result: CommandResult) -> tuple[str, str]:
    return result.refusal.name.lower(), result.reason


def _refused(refusal: Refusal, reason: str, known: dict[str, Any] | None = None) -> tuple[str, str]:
    return refusal.name.lower(), reason + (f", only {', '.join(known)}" if known else "")


def _reason(error: ValidationError, key: str = "") -> str:
    """Return the reason of the first error: the key, the fault and the received value."""
    detail = error.errors(include_url=False, include_context=False)[0]
    where = ".".join(_shown(part).strip("'\"") for part in detail["loc"]) or key or "message"
    match detail["type"]:
        case "missing":
            return f"{where}: is missing"
        case "extra_forbidden":
            return f"{where}: unknown key"
    return f"{where}: {plain_message(detail['msg'])} (got {_shown(detail['input'])})"


def _shown(value: Any) -> str:
    """Return a value from a message, shortened to `QUOTED_CHARACTERS_MAX` characters."""
    text = repr(value)
    return text if len(text) <= QUOTED_CHARACTERS_MAX else f"{text[:QUOTED_CHARACTERS_MAX]}..."
