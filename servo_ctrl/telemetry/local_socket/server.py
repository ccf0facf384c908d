"""The local socket: where the page process learns what the machine does, and brings what people want.

A Unix socket in a private directory, for the controller's user only. Whatever its clients do, the machine
never waits for them: rows come from a ring, thirty times a second, right behind a tick. What takes longer
than a tick has to spare is done in pieces, one behind each tick; docs/local_socket.md.
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

CLIENTS_AT_MOST = 16
CLIENTS_A_PIECE = 4
STATUS_S = 0.1
PULSE_S = 1.0 / 30.0
WAITING_AT_MOST = 256
"""Messages for the next pulses; the oldest are left out."""
FAREWELL_S = 0.2

_LOG = logging.getLogger(__name__)


class LocalServer:
    """`hello` is what every client gets first; `status` makes, in pieces, what `StatusEncoder` does."""

    def __init__(
        self, hello: bytes, requests: LocalRequests, rows: RowBuffer, status: Callable[[], Pieces]
    ) -> None:
        self._hello, self._requests, self._rows, self._status = hello, requests, rows, status
        self._clients: list[LocalClient] = []
        self._waiting: deque[Callable[[], bytes]] = deque(maxlen=WAITING_AT_MOST)
        self._changed = False
        self._round: Generator[None, None, None] | None = None
        """What is being told."""
        self._stepped_s = self._status_s = 0.0
        self._closing = False

    @contextlib.asynccontextmanager
    async def serving(self, at: Path | None = None) -> AsyncIterator[Path]:
        """Listen while the block runs; yields the socket's path. Raises LocalSocketError.

        Without `at`, in a directory of its own that goes with the block.
        """
        loop = asyncio.get_running_loop()
        if at is None:
            remove_left_directories()
            place: contextlib.AbstractContextManager[Path] = new_private_directory()
        else:
            place = private_and_free(at)
        with place as path:
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

    def step(self) -> bool:
        """Tell a piece of what is new, when the cycle has time; False once all is told."""
        self._stepped_s = time.monotonic()
        try:
            if self._round is None:
                if not self._clients:
                    return False
                self._round = self._tell(self._stepped_s)
            next(self._round)
        except StopIteration:
            self._round = None
            return False
        except Exception:  # noqa: BLE001  # a mistake of ours costs the connections, not the machine
            _LOG.exception("local socket: internal error")
            self._round = None
            for client in tuple(self._clients):
                client.abort()
            return False
        return True

    def pulse(self) -> None:
        """Tell all that is new."""
        while self.step():
            pass

    def _tell(self, now_s: float) -> Generator[None, None, None]:
        for number, client in enumerate(tuple(self._clients), start=1):
            client.send_rows()
            if number % CLIENTS_A_PIECE == 0:
                yield
        if self._changed or now_s - self._status_s >= STATUS_S - 0.5 * PULSE_S:
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
            if time.monotonic() - self._stepped_s > STATUS_S:
                self.pulse()

    async def _farewell(self) -> None:
        """The last status, and the end of all connections, whether they read or not."""
        self.pulse()  # what was begun
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
