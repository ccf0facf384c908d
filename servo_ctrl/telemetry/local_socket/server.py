"""The server of the local socket: sends status and rows to the page process and receives its requests.

It is a Unix socket in a private directory, for the controller's user only. The machine never waits for a
client: thirty times a second, right after a tick, the server sends rows from a ring. Work longer than the
idle time of a period is divided into pieces, one after each tick; see docs/local_socket.md.
"""

import asyncio
import contextlib
import logging
import time
from collections import deque
from collections.abc import AsyncIterator, Callable, Generator
from pathlib import Path

from servo_ctrl.telemetry.local_socket.client import LocalClient
from servo_ctrl.telemetry.local_socket.place import (
    LocalSocketError,
    new_private_directory,
    private_and_free,
    remove_left_directories,
)
from servo_ctrl.telemetry.local_socket.requests import LocalRequests
from servo_ctrl.telemetry.local_socket.rows import RowBuffer

Pieces = Generator[None, None, bytes]

CLIENTS_MAX = 16
"""Bounds the clients, of which a page is one; chosen."""
CLIENTS_PER_PIECE = 4
"""Bounds the clients that get their rows after one tick; chosen."""
STATUS_PERIOD_S = 0.1
"""Period of the status; chosen."""
ROWS_PERIOD_S = 1.0 / 30.0
"""Period of the rows; chosen."""
MESSAGES_WAITING_MAX = 256
"""Bounds the messages that wait for the next pulses; the oldest are dropped. Chosen."""
CLOSING_LIMIT_S = 0.2
"""Bounds the time for clients to read the last status; chosen."""

_LOG = logging.getLogger(__name__)


class LocalServer:
    """Sends `hello` first to every client; `status` makes the status in pieces, like `StatusEncoder`."""

    def __init__(
        self, hello: bytes, requests: LocalRequests, rows: RowBuffer, status: Callable[[], Pieces]
    ) -> None:
        self._hello, self._requests, self._rows, self._status = hello, requests, rows, status
        self._clients: list[LocalClient] = []
        self._waiting: deque[Callable[[], bytes]] = deque(maxlen=MESSAGES_WAITING_MAX)
        self._changed = False
        self._round: Generator[None, None, None] | None = None
        """The remaining pieces of the pulse in progress."""
        self._stepped_s = self._status_s = 0.0
        self._closing = False

    @contextlib.asynccontextmanager
    async def serving(self, at: Path | None = None) -> AsyncIterator[Path]:
        """Listen while the block runs, and yield the socket's path. Raises LocalSocketError.

        Without `at` the socket is in a new directory, removed after the block.
        """
        loop = asyncio.get_running_loop()
        if at is None:
            remove_left_directories()
        with new_private_directory() if at is None else private_and_free(at) as path:
            try:
                server = await loop.create_unix_server(self._client, path)
                path.chmod(0o600)
            except OSError as error:
                raise LocalSocketError(f"{path}: cannot be made: {error.strerror}") from None
            pulse = loop.create_task(self._pulse_without_cycle())
            try:
                yield path
            finally:
                server.close()
                pulse.cancel()
                await asyncio.gather(pulse, return_exceptions=True)
                await self._close_clients()

    @property
    def clients(self) -> int:
        """Number of connected clients."""
        return len(self._clients)

    def changed(self) -> None:
        """Send the status with the next pulse."""
        self._changed = True

    def send_later(self, message: Callable[[], bytes]) -> None:
        """Make a message and send it to all clients in one of the next pulses."""
        if self._clients:
            self._waiting.append(message)

    def step(self) -> bool:
        """Send the next piece of new data, called when the cycle is idle; return False once all is sent."""
        self._stepped_s = time.monotonic()
        try:
            if self._round is None:
                if not self._clients:
                    return False
                self._round = self._pieces(self._stepped_s)
            next(self._round)
        except StopIteration:
            self._round = None
            return False
        except Exception:  # noqa: BLE001  # a bug must not stop the machine, only the connections
            _LOG.exception("local socket: internal error")
            self._round = None
            for client in tuple(self._clients):
                client.abort()
            return False
        return True

    def pulse(self) -> None:
        """Send all new data."""
        while self.step():
            pass

    def _pieces(self, now_s: float) -> Generator[None, None, None]:
        for number, client in enumerate(tuple(self._clients), start=1):
            client.send_rows()
            if number % CLIENTS_PER_PIECE == 0:
                yield
        if self._changed or now_s - self._status_s >= STATUS_PERIOD_S - 0.5 * ROWS_PERIOD_S:
            self._changed, self._status_s = False, now_s
            yield
            status = yield from self._status()
            for client in tuple(self._clients):
                client.send_status(status)
        elif self._waiting:
            yield
            message = self._waiting.popleft()()
            for client in tuple(self._clients):
                client.send(message)

    def _client(self) -> LocalClient:
        return LocalClient(self._hello, self._requests, self._rows, self._join, self._leave)

    def _join(self, client: LocalClient) -> bool:
        if self._closing or len(self._clients) >= CLIENTS_MAX:
            return False
        self._clients.append(client)
        self._changed = True
        return True

    def _leave(self, client: LocalClient) -> None:
        if client in self._clients:
            self._clients.remove(client)

    async def _pulse_without_cycle(self) -> None:
        """Send to the clients while no cycle runs."""
        while True:
            await asyncio.sleep(STATUS_PERIOD_S)
            if time.monotonic() - self._stepped_s > STATUS_PERIOD_S:
                self.pulse()

    async def _close_clients(self) -> None:
        """Send the last status and end all connections, even of clients that do not read."""
        self.pulse()  # ends the pulse in progress
        self._changed = True
        self.pulse()
        self._closing = True
        await self._requests.close()
        for client in tuple(self._clients):
            client.close()
        deadline_s = time.monotonic() + CLOSING_LIMIT_S
        while self._clients and time.monotonic() < deadline_s:  # noqa: ASYNC110  # bounded, and short
            await asyncio.sleep(0.01)
        for client in tuple(self._clients):
            client.abort()
