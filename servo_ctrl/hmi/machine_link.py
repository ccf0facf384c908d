"""The page's end of the local socket: what the machine tells, kept; what a visitor wants, asked.

One task, `run`, reads and connects again when the connection ends. All else is called in its thread.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import logging
import math
from collections import deque
from typing import TYPE_CHECKING, Any

from pydantic import TypeAdapter, ValidationError

from servo_ctrl.config.local_frames import (
    JSON,
    MESSAGE_LIMIT,
    REQUEST_LIMIT,
    ROWS,
    FrameError,
    frame,
    read_frame,
    row_block,
)
from servo_ctrl.config.local_messages import Answer, Hello, Request, Reversal, ServerMessage, Who
from servo_ctrl.hmi.row_ring import RowRing

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from servo_ctrl.config.local_status import Status

KEPT_S = 60.0
"""Of rows."""
ROWS_AT_MOST = 120_000
REVERSALS_KEPT = 500
ANSWER_LIMIT_S = 2.0
CONNECT_LIMIT_S = 2.0
SILENCE_LIMIT_S = 3.0
"""The status comes ten times a second; a connection so silent is none."""
FIRST_RETRY_S, LONGEST_RETRY_S = 0.1, 2.0

_LOG = logging.getLogger(__name__)
_MESSAGES: TypeAdapter[Hello | Status | Reversal | Answer] = TypeAdapter(ServerMessage)


class MachineLink:
    """`hello` and `status`: None before the first connection, and as they were heard last after it."""

    def __init__(self, path: Path) -> None:
        self.hello: Hello | None = None
        self.status: Status | None = None
        self.connected = False
        self.problem = "not connected yet"
        """Why there is no connection; "" while there is one."""
        self.rows = RowRing((), 1)
        """Made anew when a machine with other channels answers; the numbers of its rows go on."""
        self.reversals: deque[Reversal] = deque(maxlen=REVERSALS_KEPT)
        self.listeners: list[Callable[[Status], None]] = []
        """Called with each status, and in vain where they fail."""
        self._path = path
        self._writer: asyncio.StreamWriter | None = None
        self._ids = itertools.count(1)
        self._waiting: dict[int, asyncio.Future[Answer]] = {}

    async def run(self) -> None:
        """Be connected as well as the server lets us, until cancelled."""
        retry_s = FIRST_RETRY_S
        while True:
            try:
                await self._until_lost()
            except (OSError, EOFError, FrameError, ValidationError, TimeoutError) as error:
                problem = _in_words(error)
                if problem != self.problem:
                    _LOG.warning("%s: %s", self._path, problem)
                self.problem = problem
            finally:
                retry_s = FIRST_RETRY_S if self.connected else min(2.0 * retry_s, LONGEST_RETRY_S)
                self._lost()
            await asyncio.sleep(retry_s)

    async def request(self, who: Who, do: str, **fields: Any) -> Answer:
        """Ask the machine for something; the answer comes within two seconds, from us if from nobody else."""
        number = next(self._ids)
        try:
            request = Request.model_validate({"id": number, "who": who, "do": do, **fields})
        except ValidationError as error:
            return Answer(id=number, accepted=False, refusal="malformed", reason=_in_words(error))
        payload = request.model_dump_json(exclude_defaults=True).encode()
        if len(payload) > REQUEST_LIMIT:
            reason = f"{len(payload)} bytes are too long; {REQUEST_LIMIT} is the limit"
            return Answer(id=number, accepted=False, refusal="malformed", reason=reason)
        if self._writer is None or not self.connected:
            return _unreachable(number, "there is no connection to the controller")
        answer: asyncio.Future[Answer] = asyncio.get_running_loop().create_future()
        self._waiting[number] = answer
        try:
            self._writer.write(frame(JSON, payload))
            async with asyncio.timeout(ANSWER_LIMIT_S):
                return await answer
        except TimeoutError:
            return _unreachable(number, f"the controller did not answer within {ANSWER_LIMIT_S:g} s")
        finally:
            self._waiting.pop(number, None)

    async def _until_lost(self) -> None:
        async with asyncio.timeout(CONNECT_LIMIT_S):
            reader, writer = await asyncio.open_unix_connection(str(self._path))
        self._writer = writer
        try:
            while True:
                async with asyncio.timeout(SILENCE_LIMIT_S):
                    kind, payload = await read_frame(reader, MESSAGE_LIMIT)
                if kind == JSON:
                    self._take(_MESSAGES.validate_json(payload))
                elif kind == ROWS and self.connected:
                    block = row_block(payload, len(self.rows.names))
                    self.rows.missed = block.missed
                    self.rows.extend(block.values)
        finally:
            self._writer = None
            writer.close()
            with contextlib.suppress(OSError):
                await writer.wait_closed()

    def _take(self, message: Hello | Status | Reversal | Answer) -> None:
        match message:
            case Hello():
                self._greet(message)
            case Reversal():
                self.reversals.append(message)
            case Answer():
                waiting = self._waiting.get(message.id)
                if waiting is not None and not waiting.done():
                    waiting.set_result(message)
            case _:
                self.status = message
                for listener in tuple(self.listeners):
                    _tell(listener, message)

    def _greet(self, hello: Hello) -> None:
        names = tuple(channel.name for channel in hello.channels)
        if names != self.rows.names:
            capacity = min(math.ceil(KEPT_S / hello.period_s), ROWS_AT_MOST)
            self.rows = RowRing(names, capacity, self.rows.end)
        self.hello = hello
        self.connected, self.problem = True, ""

    def _lost(self) -> None:
        self.connected = False
        for number, waiting in self._waiting.items():
            if not waiting.done():
                waiting.set_result(_unreachable(number, "the connection to the controller was lost"))


def _tell(listener: Callable[[Status], None], status: Status) -> None:
    try:
        listener(status)
    except Exception:  # noqa: BLE001  # a page that fails costs the others nothing
        _LOG.exception("a listener failed")


def _unreachable(number: int, reason: str) -> Answer:
    return Answer(id=number, accepted=False, refusal="unreachable", reason=reason)


def _in_words(error: Exception) -> str:
    if isinstance(error, ValidationError):
        first = error.errors(include_url=False, include_context=False)[0]
        return f"{'.'.join(str(part) for part in first['loc'])}: {first['msg']}"
    if isinstance(error, EOFError):
        return "the controller has ended the connection"
    if isinstance(error, TimeoutError):
        return "the controller is silent"
    return str(error)
