"""Executes requests from the page: reads them strictly, answers each once, and logs each with its sender.

Commands, settings and jogs are executed at once. Objects of nodes and programs take longer and are answered
later; a stop does not wait for them.
"""

import asyncio
import logging
import time
from collections.abc import Awaitable, Callable
from typing import Any, NamedTuple, Protocol

from pydantic import ValidationError

from servo_ctrl.commands.client_activity import ClientActivity
from servo_ctrl.commands.command import COMMANDS, JOG_RENEWAL_S, CommandRequest, CommandResult, Refusal
from servo_ctrl.commands.handler import CommandHandler
from servo_ctrl.commands.local_messages import (
    LocalAnswer,
    LocalRequest,
    ProgramText,
    RequestValue,
    TuningRun,
    message_json,
)
from servo_ctrl.commands.settings import SETTINGS
from servo_ctrl.config.part_program import PartProgram
from servo_ctrl.config.program_model import ProgramConfig
from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.telemetry.local_socket.record import LOGGED_CHARACTERS_MAX, in_words, reason_of, record_of

Reply = Callable[[bytes], None]

REQUIRED_FIELDS: dict[str, set[str]] = {
    "command": {"command"},
    "setting": {"setting", "value"},
    "jog": {"axis", "value"},
    "jog_step": {"axis", "value"},
    "touch_off": {"value"},
    "run_line": {"value"},
    "load_program": {"program"},
    "tuning_run": {"tuning"},
    "read_object": {"node", "index"},
    "write_object": {"node", "index", "value"},
}
"""Required fields of a request, by `do`."""
OPTIONAL_FIELDS = {
    "command": {"axis"},
    "touch_off": {"axis"},
    "read_object": {"subindex"},
    "write_object": {"subindex"},
}
"""Optional fields of a request, by `do`."""
SLOW_REQUESTS = {"read_object", "write_object", "load_program", "run_line", "tuning_run"}
"""Requests that take longer than the idle time of a period."""
VALUE_TYPES: dict[str, tuple[str, tuple[type, ...]]] = {
    "jog": ("a velocity in m/s", (int, float)),
    "jog_step": ("a distance in m", (int, float)),
    "touch_off": ("a length in m", (int, float)),
    "run_line": ("a line of G-code", (str,)),
}
"""Meaning and types of the value of a request, by `do`."""
_ENVELOPE = {"kind", "id", "who", "do"}
TASKS_MAX = 16
"""Bounds the slow requests in progress, of all clients; chosen."""
AXES_MAX = 64
"""Bounds the axis names whose last jog is remembered; chosen, more than any machine has."""

_LOG = logging.getLogger(__name__)


class Outcome(NamedTuple):
    """The result of a request."""

    refusal: Refusal = Refusal.NONE
    reason: str = ""
    value: int | float | str | None = None


class Objects(Protocol):
    """Access to the objects of nodes, bounded in time; see `daemon.page.object_access`."""

    async def read(self, node: int, index: int, subindex: int) -> Outcome:
        """Read the value of an object."""

    async def write(self, node: int, index: int, subindex: int, value: float | str | bool) -> Outcome:
        """Write an object."""


class RequestTargets(NamedTuple):
    """The parts of the controller that requests act on."""

    commands: CommandHandler
    objects: Objects
    read_program: Callable[[ProgramText], Awaitable[ProgramConfig]]
    """Reads a program. Raises ServoCtrlError."""
    read_line: Callable[[str], Awaitable[PartProgram]]
    """Reads a line of G-code that starts where the axes stand. Raises ServoCtrlError."""
    tuning_run: Callable[[TuningRun, ClientActivity], Awaitable[Outcome]]
    """Makes a motion of a tuning, which ends early once its client is disconnected or silent.

    Its value is the directory of the recording. Raises ServoCtrlError.
    """
    clear_counters: Callable[[], None]
    log: Callable[[dict[str, Any]], None]
    note: Callable[[str], None]
    """Logs an event."""
    cycle: Callable[[], int]


class LocalRequests:
    """Executes and answers the requests of all clients."""

    def __init__(self, targets: RequestTargets) -> None:
        self._targets = targets
        self._jogs: dict[str, tuple[str, RequestValue | None, float]] = {}
        """By axis: user, velocity and time of its last jog."""
        self._tasks: set[asyncio.Task[None]] = set()

    def read(self, payload: bytes) -> LocalRequest | bytes:
        """Return the request in a message, or the answer to a malformed message."""
        try:
            request = LocalRequest.model_validate_json(payload)
        except ValidationError as error:
            return self.malformed(reason_of(error))
        required, given = REQUIRED_FIELDS.get(request.do, set()), request.model_fields_set - _ENVELOPE
        if missing := required - given:
            return self.malformed(f"{request.do}: {min(missing)} is missing", request.id)
        if superfluous := given - required - OPTIONAL_FIELDS.get(request.do, set()):
            return self.malformed(f"{request.do}: {min(superfluous)} does not belong to it", request.id)
        expected, kinds = VALUE_TYPES.get(request.do, ("", ()))
        if expected and type(request.value) not in kinds:
            return self.malformed(f"{request.do}: value: expected {expected}", request.id)
        return request

    def malformed(self, reason: str, number: int = 0) -> bytes:
        """Return the answer to a malformed message; `number` is 0 if its id is unreadable."""
        return message_json("answer", LocalAnswer(number, False, "malformed", reason))

    def carry_out(self, request: LocalRequest, reply: Reply, activity: ClientActivity) -> None:
        """Execute a request of this client and reply, at once or later."""
        activity.requests += 1
        if request.do not in SLOW_REQUESTS:
            self._answer(request, self._execute_now(request), reply)
        elif len(self._tasks) >= TASKS_MAX:
            self._answer(request, Outcome(Refusal.WRONG_STATE, "too many requests are waiting"), reply)
        else:
            task = asyncio.get_running_loop().create_task(self._run_slow(request, reply, activity))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)

    async def close(self) -> None:
        """Cancel the requests in progress."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _run_slow(self, request: LocalRequest, reply: Reply, activity: ClientActivity) -> None:
        try:
            outcome = await self._execute_slow(request, activity)
        except ServoCtrlError as error:
            outcome = Outcome(Refusal.OUT_OF_RANGE, str(error))
        except Exception as bug:  # noqa: BLE001  # a bug must not stop the machine, only this request
            _LOG.exception("local socket: internal error")
            outcome = Outcome(Refusal.WRONG_STATE, repr(bug))
        self._answer(request, outcome, reply)

    async def _execute_slow(self, request: LocalRequest, activity: ClientActivity) -> Outcome:
        if request.program is not None:
            program = await self._targets.read_program(request.program)
            return _outcome(self._targets.commands.load_program(program))
        if request.tuning is not None:
            return await self._targets.tuning_run(request.tuning, activity)
        if request.do == "run_line":
            line = await self._targets.read_line(str(request.value))
            return _outcome(self._targets.commands.run_line(line))
        node, index, subindex = request.node or 0, request.index or 0, request.subindex or 0
        if request.value is None:
            return await self._targets.objects.read(node, index, subindex)
        return await self._targets.objects.write(node, index, subindex, request.value)

    def _execute_now(self, request: LocalRequest) -> Outcome:
        commands = self._targets.commands
        axis, value = request.axis, request.value
        given = float(value) if isinstance(value, int | float) else 0.0
        moves = {"jog": commands.jog, "jog_step": commands.jog_step, "touch_off": commands.touch_off}
        if request.do in moves:
            return _outcome(moves[request.do](axis, given))
        match request.do:
            case "command":
                command = COMMANDS.get(request.command or "")
                if command is None:
                    return Outcome(Refusal.UNKNOWN, f'there is no command "{request.command}"')
                return _outcome(commands.execute(CommandRequest(command, request.axis)))
            case "setting":
                return self._change(request)
            case "clear_counters":
                self._targets.clear_counters()
        # a heartbeat has no effect of its own, and the page manages the right of control
        return Outcome()

    def _change(self, request: LocalRequest) -> Outcome:
        setting, value = SETTINGS[request.setting or ""], request.value
        if setting.kind is float and type(value) is int:
            value = float(value)
        names = setting.entry.names
        if value is None or type(value) is not setting.kind or (names and value not in names):
            expected = " or ".join(names) or ("metres" if setting.kind is float else "true or false")
            return Outcome(Refusal.OUT_OF_RANGE, f"value: expected {expected}")
        return _outcome(self._targets.commands.change(setting.name, value))

    def _answer(self, request: LocalRequest, outcome: Outcome, reply: Reply) -> None:
        refusal, accepted = outcome.refusal.name.lower(), outcome.refusal is Refusal.NONE
        answer = LocalAnswer(request.id, accepted, refusal, outcome.reason, outcome.value)
        reply(message_json("answer", answer))
        if request.do == "heartbeat" or (request.do == "jog" and self._is_renewal(request)):
            return
        result = {"accepted": accepted, "refusal": refusal, "reason": outcome.reason[:LOGGED_CHARACTERS_MAX]}
        self._targets.log({**record_of(request, self._targets.cycle()), **result})
        if request.do != "read_object":
            self._targets.note(in_words(request) + ("" if accepted else f": refused: {outcome.reason}"))

    def _is_renewal(self, request: LocalRequest) -> bool:
        """Whether this jog only renews the last one."""
        user, value, now_s = request.who.user, request.value, time.monotonic()
        last = self._jogs.get(request.axis)
        if last is None and len(self._jogs) >= AXES_MAX:
            self._jogs.clear()  # a client sends invented names
        self._jogs[request.axis] = user, value, now_s
        if last is None or last[:2] != (user, value):
            return False
        return value == 0.0 or now_s - last[2] <= 2.0 * JOG_RENEWAL_S


def _outcome(result: CommandResult) -> Outcome:
    return Outcome(result.refusal, result.reason)
