"""The client of the local socket: keeps the newest state of the machine, and sends requests.

The task `run` reads, and connects again when the connection ends; everything else is called in its thread.
"""

import asyncio
import contextlib
import itertools
import logging
import math
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from servo_ctrl.commands.local_frames import (
    JSON,
    MESSAGE_LIMIT,
    REQUEST_LIMIT,
    ROWS,
    frame,
    read_frame,
    row_block,
)
from servo_ctrl.commands.local_messages import (
    Hello,
    LocalAnswer,
    LocalRequest,
    Requester,
    Reversal,
    ServerMessage,
    server_message,
)
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.hmi.link.row_ring import RowRing

KEPT_ROWS_S = 60.0
"""Time span of the rows that are kept, seconds; from the longest time base of the scope."""
MAX_ROWS = 120_000
"""Bounds the memory where the cycle is shorter than 0.5 ms: 27 channels take some 50 MB."""
MAX_REVERSALS = 500
"""Bounds the reversals that are kept; chosen."""
ANSWER_TIMEOUT_S = 2.0
"""Bounds the wait for an answer, seconds; chosen: the controller accesses an object within one second and
gives other answers at once."""
CONNECT_TIMEOUT_S = 2.0
"""Bounds the wait for a connection, seconds; chosen."""
SILENCE_TIMEOUT_S = 3.0
"""Bounds the time without a status before the connection counts as lost, seconds; chosen: a status is sent
ten times a second."""
FIRST_RETRY_S, LONGEST_RETRY_S = 0.1, 2.0
"""Bound the delay before the next attempt to connect, seconds; chosen. The delay doubles with each
failure."""

NO_CONNECTION = "there is no connection to the controller"

_LOG = logging.getLogger(__name__)


class MachineLink:
    """The connection and the newest messages; `hello` and `status` are None before the first connection."""

    def __init__(self, path: Path) -> None:
        self.hello: Hello | None = None
        self.status: MachineStatus | None = None
        self.connected = False
        self.problem = "not connected yet"
        """Why there is no connection; "" while there is one."""
        self.rows = RowRing((), 1)
        """Replaced when a machine with other channels answers; the row numbers go on."""
        self.reversals: deque[Reversal] = deque(maxlen=MAX_REVERSALS)
        self.listeners: list[Callable[[MachineStatus], None]] = []
        """Called with each status; an exception in one is logged and does not reach the others."""
        self.path = path
        self._writer: asyncio.StreamWriter | None = None
        self._ids = itertools.count(1)
        self._pending: dict[int, asyncio.Future[LocalAnswer]] = {}

    async def run(self) -> None:
        """Keep connected until cancelled."""
        retry_s = FIRST_RETRY_S
        while True:
            try:
                await self._read_until_lost()
            except (OSError, EOFError, ServoCtrlError, TimeoutError) as error:
                problem = _reason_of(error)
                if problem != self.problem:
                    _LOG.warning("%s: %s", self.path, problem)
                self.problem = problem
            except Exception as error:  # noqa: BLE001  # an unexpected message must not end the link
                _LOG.exception("%s: the connection failed", self.path)
                self.problem = f"{type(error).__name__}: {error}"
            finally:
                retry_s = FIRST_RETRY_S if self.connected else min(2.0 * retry_s, LONGEST_RETRY_S)
                self._fail_pending()
            await asyncio.sleep(retry_s)

    async def request(
        self, who: Requester, do: str, *, limit_s: float = ANSWER_TIMEOUT_S, **fields: Any
    ) -> LocalAnswer:
        """Send a request and return its answer; `fields` are those of `commands.local_messages.LocalRequest`.

        Without one within `limit_s` the answer is our own, with refusal "unreachable".
        """
        number = next(self._ids)
        try:
            request = LocalRequest.model_validate({"id": number, "who": who, "do": do, **fields})
        except ValidationError as error:
            return _refused(number, _reason_of(error), "malformed")
        payload = request.model_dump_json(exclude_defaults=True).encode()
        if len(payload) > REQUEST_LIMIT:
            reason = f"{len(payload)} bytes are too long; {REQUEST_LIMIT} is the limit"
            return _refused(number, reason, "malformed")
        if self._writer is None or not self.connected:
            return _refused(number, NO_CONNECTION)
        answer: asyncio.Future[LocalAnswer] = asyncio.get_running_loop().create_future()
        self._pending[number] = answer
        try:
            self._writer.write(frame(JSON, payload))
            async with asyncio.timeout(limit_s):
                return await answer
        except TimeoutError:
            return _refused(number, f"the controller did not answer within {limit_s:g} s")
        finally:
            self._pending.pop(number, None)

    async def _read_until_lost(self) -> None:
        async with asyncio.timeout(CONNECT_TIMEOUT_S):
            reader, writer = await asyncio.open_unix_connection(str(self.path))
        self._writer = writer
        try:
            while True:
                async with asyncio.timeout(SILENCE_TIMEOUT_S):
                    kind, payload = await read_frame(reader, MESSAGE_LIMIT)
                if kind == JSON:
                    self._handle(server_message(payload))
                elif kind == ROWS and self.connected:
                    self.rows.extend(row_block(payload, len(self.rows.names)).values)
        finally:
            self._writer = None
            writer.close()
            with contextlib.suppress(OSError):
                await writer.wait_closed()

    def _handle(self, message: ServerMessage) -> None:
        match message:
            case Hello():
                self._handle_hello(message)
            case Reversal():
                self.reversals.append(message)
            case LocalAnswer():
                answer = self._pending.get(message.id)
                if answer is not None and not answer.done():
                    answer.set_result(message)
            case _:
                self.status = message
                for listener in tuple(self.listeners):
                    try:
                        listener(message)
                    except Exception:  # noqa: BLE001  # an error of one page must not reach the others
                        _LOG.exception("a listener of the status failed")

    def _handle_hello(self, hello: Hello) -> None:
        names = tuple(channel.name for channel in hello.channels)
        if names != self.rows.names:
            capacity = min(math.ceil(KEPT_ROWS_S / hello.period_s), MAX_ROWS)
            self.rows = RowRing(names, capacity, self.rows.end)
        self.hello = hello
        self.connected, self.problem = True, ""

    def _fail_pending(self) -> None:
        self.connected = False
        for number, answer in self._pending.items():
            if not answer.done():
                answer.set_result(_refused(number, "the connection to the controller was lost"))


def _refused(number: int, reason: str, refusal: str = "unreachable") -> LocalAnswer:
    return LocalAnswer(id=number, accepted=False, refusal=refusal, reason=reason)


def _reason_of(error: Exception) -> str:
    match error:
        case ValidationError():
            first = error.errors(include_url=False, include_context=False)[0]
            return f"{'.'.join(map(str, first['loc']))}: {first['msg']}"
        case EOFError():
            return "the controller has ended the connection"
        case TimeoutError():
            return "the controller sends no status"
    return str(error)
