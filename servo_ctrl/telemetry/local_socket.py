"""The local socket: where the page process learns what the machine does, and brings what people want.

A Unix socket in a directory of its own, for the controller's user only. Whatever its clients do, the machine
never waits for them: rows come from a ring, thirty times a second, right behind a tick; docs/local_socket.md.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import shutil
import tempfile
import time
from collections import deque
from pathlib import Path
from typing import TYPE_CHECKING

from servo_ctrl.config.errors import ServoCtrlError
from servo_ctrl.telemetry.local_socket_client import LocalClient

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable

    from servo_ctrl.telemetry.local_socket_requests import RequestDesk
    from servo_ctrl.telemetry.local_socket_rows import RowBuffer

CLIENTS_AT_MOST = 16
STATUS_S = 0.1
PULSE_S = 1.0 / 30.0
WAITING_AT_MOST = 256
"""Messages for the next pulses; the oldest are left out."""
FAREWELL_S = 0.2

_LOG = logging.getLogger(__name__)


class LocalSocketError(ServoCtrlError):
    """The socket cannot be made."""


class LocalServer:
    """`hello` is what every client gets first, `status` gives what `StatusEncoder` makes."""

    def __init__(
        self, hello: bytes, requests: RequestDesk, rows: RowBuffer, status: Callable[[], bytes]
    ) -> None:
        self._hello, self._requests, self._rows, self._status = hello, requests, rows, status
        self._clients: list[LocalClient] = []
        self._waiting: deque[Callable[[], bytes]] = deque(maxlen=WAITING_AT_MOST)
        self._changed = False
        self._pulse_s = self._status_s = 0.0
        self._closing = False

    @contextlib.asynccontextmanager
    async def serving(self) -> AsyncIterator[Path]:
        """Listen while the block runs; yields the socket's path. Raises LocalSocketError."""
        loop = asyncio.get_running_loop()
        try:
            directory = Path(tempfile.mkdtemp(prefix="servo-ctrl-page-"))  # 0700
        except OSError as error:
            raise LocalSocketError(f"no directory for the page's socket: {error.strerror}") from None
        path = directory / "page.sock"
        try:
            try:
                server = await loop.create_unix_server(self._client, path)
                path.chmod(0o600)
            except OSError as error:
                raise LocalSocketError(f"{path}: cannot be made: {error.strerror}") from None
            keeper = loop.create_task(self._keep_telling())
            try:
                yield path
            finally:
                server.close()
                keeper.cancel()
                await asyncio.gather(keeper, return_exceptions=True)
                await self._farewell()
        finally:
            shutil.rmtree(directory, ignore_errors=True)

    @property
    def clients(self) -> int:
        """How many are connected."""
        return len(self._clients)

    def changed(self) -> None:
        """The status is not as it was: it is sent with the next pulse."""
        self._changed = True

    def tell_later(self, message: Callable[[], bytes]) -> None:
        """Tell all clients with one of the next pulses; the message is made then."""
        if self._clients:
            self._waiting.append(message)

    def pulse(self) -> None:
        """Send what is new; called about thirty times a second, when the cycle has time."""
        self._pulse_s = time.monotonic()
        if not self._clients:
            return
        try:
            self._tell(self._pulse_s)
        except Exception:  # noqa: BLE001  # a mistake of ours costs the connections, not the machine
            _LOG.exception("local socket: internal error")
            for client in tuple(self._clients):
                client.abort()

    def _tell(self, now_s: float) -> None:
        clients = tuple(self._clients)
        if self._changed or now_s - self._status_s >= STATUS_S - 0.5 * PULSE_S:
            self._changed, self._status_s = False, now_s
            status = self._status()
            for client in clients:
                client.send_status(status)
        elif self._waiting:  # one thing at a time: the next tick is near
            message = self._waiting.popleft()()
            for client in clients:
                client.send(message)
        for client in clients:
            client.send_rows()

    def _client(self) -> LocalClient:
        return LocalClient(self._hello, self._requests, self._rows, self._join, self._leave)

    def _join(self, client: LocalClient) -> bool:
        if self._closing or len(self._clients) >= CLIENTS_AT_MOST:
            return False
        self._clients.append(client)
        self._changed = True
        return True

    def _leave(self, client: LocalClient) -> None:
        if client in self._clients:
            self._clients.remove(client)

    async def _keep_telling(self) -> None:
        """While no cycle runs, the clients still hear of us."""
        while True:
            await asyncio.sleep(STATUS_S)
            if time.monotonic() - self._pulse_s > STATUS_S:
                self.pulse()

    async def _farewell(self) -> None:
        """The last status, and the end of all connections, whether they read or not."""
        self._changed = True
        self.pulse()
        self._closing = True
        await self._requests.close()
        for client in tuple(self._clients):
            client.close()
        deadline_s = time.monotonic() + FAREWELL_S
        while self._clients and time.monotonic() < deadline_s:  # noqa: ASYNC110  # bounded, and short
            await asyncio.sleep(0.01)
        for client in tuple(self._clients):
            client.abort()
